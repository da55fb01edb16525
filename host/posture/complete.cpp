#include "host/posture/complete.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "host/io/io.hpp"
#include "host/io/numbers.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPiece_s = 0.5;  // of the shown hand, one observation
constexpr std::size_t kMostPieces = 200;
constexpr double kRest_s = 0.25;            // of what is shown: as much as a document's resting poses are of
constexpr double kBeyond_deg = 15;          // of the limits, before a reading is implausible
constexpr int kStillRows = 32;              // of one reading, before it may be stuck
constexpr double kStuck = 3;                // standard errors of what the others predict
constexpr double kNoisy_deg = 5;            // a reading that shivers by less is taken as it is
constexpr double kLeast_deg = 0.1;          // no reading is surer than that
constexpr double kLeastCoupled_deg = 0.01;  // a posture document's last digit
constexpr std::size_t kMostModels = 32;     // some megabytes each

std::uint32_t bit(Index input) { return std::uint32_t{1} << input; }

std::vector<Index> inputs_of(std::uint32_t mask) {
  std::vector<Index> out;
  for (Index input = 0; mask >> input != 0; ++input)
    if (mask & bit(input)) out.push_back(input);
  return out;
}

void require_inputs(const std::vector<Input>& inputs) {
  constexpr std::size_t kMost = 30;
  if (inputs.empty()) throw io::InputError("no input: name the sensed columns with --from");
  if (inputs.size() > kMost) throw io::InputError("{} inputs; at most {}", inputs.size(), kMost);
  std::set<std::vector<int>> seen;
  for (const Input& input : inputs) {
    if (!seen.insert(input.joints).second) {
      throw io::InputError("input \"{}\" is there twice; name it once", input.name);
    }
  }
}

}  // namespace

void Shiver::push(double reading_deg) {
  constexpr std::size_t kWindow = 48;
  if (std::isnan(reading_deg)) return last_.clear();
  last_.push_back(reading_deg);
  if (last_.size() < 4) return;
  size_.push_back(std::abs(last_[3] - 3 * last_[2] + 3 * last_[1] - last_[0]));
  last_.pop_front();
  if (size_.size() > kWindow) size_.pop_front();
}

// White noise of deviation s has third differences of deviation sqrt(20) s, their median size 0.6745 of it.
double Shiver::variance_deg2() const {
  constexpr std::size_t kEnough = 12;
  if (size_.size() < kEnough) return 0;
  const double deviation = io::median({size_.begin(), size_.end()}) / (0.6745 * std::sqrt(20.0));
  return deviation * deviation;
}

Personal::Personal(Calibrated calibrated, InputMatrix inputs)
    : calibrated_(std::move(calibrated)),
      inputs_(std::move(inputs)),
      seen_(calibrated_.regression, inputs_, Hand::Zero(), {}),
      stranger_deg2_(scale_deg2(calibrated_, inputs_, 0)),
      acquainted_deg2_(stranger_deg2_) {}

void Personal::learn(const std::vector<Hand>& hands) {
  seen_ = Seen(calibrated_.regression, inputs_, calibrated_.regression.offset_deg(hands.front()), hands);
  if (hands.size() == seen_at_) return;
  seen_at_ = hands.size();
  acquainted_deg2_ = scale_deg2(calibrated_, inputs_, seen_at_);
}

void Completer::Readings::leave_out(Index input, Quality why) {
  set_quality(input, why);
  mask &= ~bit(input);
}

VectorXd Completer::Readings::of(Mask inputs) const { return value_deg(inputs_of(inputs)); }

Completer::Completer(const Posture& posture, std::vector<Input> inputs, bool rested)
    : posture_(posture),
      inputs_(std::move(inputs)),
      matrix_(input_matrix(inputs_)),
      low_deg_(matrix_ * posture.limits.low_deg.matrix()),
      high_deg_(matrix_ * posture.limits.high_deg.matrix()),
      shiver_(inputs_.size()),
      still_(inputs_.size()) {
  require_inputs(inputs_);
  all_ = bit(matrix_.rows()) - 1;
  for (const Person& person : posture.people) people_.push_back(&person);
  shape_ = choose_shape(people_, matrix_, rested);
}

Personal& Completer::model(Mask mask) {
  const auto it = models_.find(mask);
  if (it != models_.end()) return *it->second;
  if (models_.size() >= kMostModels) models_.clear();
  const InputMatrix inputs = matrix_(inputs_of(mask), Eigen::all);
  auto made = std::make_unique<Personal>(calibrate(people_, inputs, shape_, matrix_), inputs);
  if (!seen_.empty()) made->learn(seen_);
  return *models_.emplace(mask, std::move(made)).first->second;
}

// What is shown first is the resting pose, and the first hand that is seen; the means of half a second each follow.
void Completer::show(const Hand& hand_deg, double seconds) {
  piece_sum_ += hand_deg;
  ++piece_rows_;
  piece_s_ += seconds;
  const bool full = piece_s_ >= (rests_ ? kRest_s : kPiece_s);
  if (rests_) {
    seen_.assign(1, piece_sum_ / piece_rows_);
    rests_ = !full;
  } else if (full && seen_.size() < kMostPieces) {
    seen_.push_back(piece_sum_ / piece_rows_);
  } else {
    return;
  }
  if (full) {
    piece_sum_ = Hand::Zero();
    piece_rows_ = piece_s_ = 0;
  }
  for (auto& [mask, personal] : models_) personal->learn(seen_);
}

Completer::Prediction Completer::from_others(const Readings& readings, Index input) {
  const Mask others = readings.mask & ~bit(input);
  const Personal& personal = model(others);
  return {matrix_.row(input).dot(personal.mean_deg(readings.of(others)).matrix()),
          personal.calibrated().target_error_deg2[input], personal.calibrated().target_worst_deg[input]};
}

void Completer::leave_out_missing(Readings& readings) {
  for (const Index i : inputs_of(all_)) {
    shiver_[static_cast<std::size_t>(i)].push(readings.value_deg[i]);
    if (std::isnan(readings.value_deg[i])) readings.leave_out(i, Quality::missing);
  }
}

// A sensor that lost its contact keeps one value to the last digit; a finger at rest does so too, but then the others predict
// that it does. What is stuck stays so until it changes.
void Completer::leave_out_stuck(Readings& readings) {
  for (const Index i : inputs_of(readings.mask)) {
    const Mask others = readings.mask & ~bit(i);
    const double reading = readings.value_deg[i];
    Still& still = still_[static_cast<std::size_t>(i)];
    if (others == 0) continue;
    const Prediction predicted = from_others(readings, i);
    if (still.rows == 0 || reading != still.reading_deg) {
      still = {reading, others, predicted.value_deg, 0, 1};
      continue;
    }
    if (still.others != others) {
      still.others = others;
      still.predicted_deg = predicted.value_deg;
    }
    still.moved_deg = std::max(still.moved_deg, std::abs(predicted.value_deg - still.predicted_deg));
    if (++still.rows < kStillRows || still.moved_deg < kStuck * std::sqrt(predicted.variance_deg2)) continue;
    readings.leave_out(i, Quality::stuck);
  }
}

void Completer::leave_out_implausible(Readings& readings) {
  for (const Index i : inputs_of(readings.mask)) {
    const double reading = readings.value_deg[i];
    if (reading < low_deg_[i] - kBeyond_deg || reading > high_deg_[i] + kBeyond_deg)
      readings.leave_out(i, Quality::implausible);
  }
  for (;;) {  // the least plausible one first: it spoils what is predicted of the others
    std::optional<Index> worst;
    double most = kImplausible;
    for (const Index i : inputs_of(readings.mask)) {
      if (readings.mask == bit(i)) continue;
      const Prediction predicted = from_others(readings, i);
      const double away = std::abs(readings.value_deg[i] - predicted.value_deg) / predicted.worst_deg;
      if (away <= most) continue;
      most = away;
      worst = i;
    }
    if (!worst) return;
    readings.leave_out(*worst, Quality::implausible);
  }
}

// Up to kBeyond_deg, further is implausible.
void Completer::mark_beyond(Readings& readings) const {
  for (const Index i : inputs_of(readings.mask)) {
    double& reading = readings.value_deg[i];
    if (reading >= low_deg_[i] && reading <= high_deg_[i]) continue;
    reading = std::clamp(reading, low_deg_[i], high_deg_[i]);
    readings.set_quality(i, Quality::beyond);
  }
}

void Completer::weigh_noisy(Readings& readings) {
  const Readings raw = readings;
  for (const Index i : inputs_of(raw.mask)) {
    const double noise_deg2 = shiver_[static_cast<std::size_t>(i)].variance_deg2();
    if (noise_deg2 < kNoisy_deg * kNoisy_deg || raw.mask == bit(i)) continue;
    const Prediction predicted = from_others(raw, i);
    const double share = predicted.variance_deg2 / (predicted.variance_deg2 + noise_deg2);
    readings.value_deg[i] = std::lerp(predicted.value_deg, raw.value_deg[i], share);
    readings.variance_deg2[i] = share * noise_deg2;
    readings.set_quality(i, Quality::noisy);
  }
}

// By how much the angles move when a noisy input does.
void Completer::add_noise(const Readings& readings, Hand& variance_deg2) {
  const Personal& personal = model(readings.mask);
  for (const Index i : inputs_of(readings.mask)) {
    if (readings.variance_deg2[i] == 0) continue;
    Readings up = readings;
    Readings down = readings;
    up.value_deg[i] += std::sqrt(readings.variance_deg2[i]);
    down.value_deg[i] -= std::sqrt(readings.variance_deg2[i]);
    const Hand change = personal.mean_deg(up.of(up.mask)) - personal.mean_deg(down.of(down.mask));
    variance_deg2 += (change / 2).square();
  }
}

bool Completer::sensed_alone(Mask mask, int joint) const {
  return std::ranges::any_of(inputs_of(mask), [&](Index i) {
    return inputs_[static_cast<std::size_t>(i)].joints == std::vector<int>{joint};
  });
}

// The joints that are less certain give way more; one that meets its limit leaves the rest to the others.
void Completer::keep_sum(const std::vector<int>& joints, double sum_deg, Estimate& estimate) const {
  const auto& [low_deg, high_deg] = posture_.limits;
  std::vector<int> free = joints;
  for (const int joint : joints)
    estimate.angle_deg[joint] = std::clamp(estimate.angle_deg[joint], low_deg[joint], high_deg[joint]);
  while (!free.empty()) {
    double lacking_deg = sum_deg;
    double total_deg2 = 0;
    for (const int joint : joints) lacking_deg -= estimate.angle_deg[joint];
    for (const int joint : free) total_deg2 += estimate.se_deg[joint] * estimate.se_deg[joint];
    std::vector<int> still_free;
    for (const int joint : free) {
      const double share = estimate.se_deg[joint] * estimate.se_deg[joint] / total_deg2;
      const double wanted_deg = estimate.angle_deg[joint] + share * lacking_deg;
      estimate.angle_deg[joint] = std::clamp(wanted_deg, low_deg[joint], high_deg[joint]);
      if (estimate.angle_deg[joint] == wanted_deg) still_free.push_back(joint);
    }
    if (still_free.size() == free.size()) return;
    free = still_free;
  }
}

// A joint that is sensed by itself is what was read.
void Completer::set_sensed(const Readings& readings, Estimate& estimate) const {
  for (const Index i : inputs_of(readings.mask)) {
    const std::vector<int>& joints = inputs_[static_cast<std::size_t>(i)].joints;
    keep_sum(joints, readings.value_deg[i], estimate);
    if (joints.size() > 1) continue;
    estimate.se_deg[joints[0]] = std::max(kLeast_deg, std::sqrt(readings.variance_deg2[i]));
  }
}

void Completer::set_coupled(const Readings& readings, Estimate& estimate) const {
  for (const CoupledCurve& curve : posture_.curves) {
    const auto [joint, follows] = curve.coupling;
    if (!sensed_alone(readings.mask, follows) || sensed_alone(readings.mask, joint)) continue;
    const double angle = estimate.angle_deg[follows];
    const double se = estimate.se_deg[follows];
    const double through = (curve.at(angle + se) - curve.at(angle - se)) / 2;
    estimate.angle_deg[joint] = curve.at(angle);
    estimate.se_deg[joint] = std::max(kLeastCoupled_deg, std::hypot(curve.sd_deg, through));
  }
}

Estimate Completer::complete(const VectorXd& readings_deg) {
  Readings readings{readings_deg, VectorXd::Zero(readings_deg.size()),
                    std::vector<Quality>(inputs_.size(), Quality::used), all_};
  leave_out_missing(readings);
  leave_out_implausible(readings);
  leave_out_stuck(readings);
  mark_beyond(readings);
  weigh_noisy(readings);
  const Personal& personal = model(readings.mask);
  const VectorXd inputs = readings.of(readings.mask);
  Hand variance_deg2 = personal.variance_deg2(inputs);
  add_noise(readings, variance_deg2);
  Estimate estimate{personal.mean_deg(inputs), variance_deg2.max(kLeast_deg * kLeast_deg).sqrt(),
                    readings.quality};
  set_sensed(readings, estimate);
  set_coupled(readings, estimate);
  estimate.angle_deg = estimate.angle_deg.max(posture_.limits.low_deg).min(posture_.limits.high_deg);
  return estimate;
}

}  // namespace flexor::posture
