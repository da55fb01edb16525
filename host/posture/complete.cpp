#include "host/posture/complete.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "host/io/io.hpp"

namespace flexor::posture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPiece_s = 0.5;  // of the shown hand, one observation
constexpr std::size_t kMostPieces = 200;
constexpr double kStill_deg = 10;           // a resting hand stays within, mean of its joints
constexpr double kBeyond_deg = 15;          // of the limits, before a reading is implausible
constexpr int kStillRows = 32;              // of one reading, before it may be stuck
constexpr double kStuck = 3;                // standard errors of what the others say
constexpr double kNoisy_deg = 5;            // a reading that shivers by less is taken as it is
constexpr double kLeast_deg = 0.1;          // no reading is surer than that
constexpr double kLeastCoupled_deg = 0.01;  // a posture document's last digit
constexpr std::size_t kMostModels = 32;     // some megabytes each

std::uint32_t bit(std::size_t i) { return std::uint32_t{1} << i; }

void require_inputs(const std::vector<Input>& inputs) {
  constexpr std::size_t kMost = 30;
  if (inputs.empty()) throw io::InputError("no input: name the sensed columns with --from");
  if (inputs.size() > kMost) throw io::InputError(fmt::format("{} inputs; at most {}", inputs.size(), kMost));
  std::set<std::vector<int>> seen;
  for (const Input& input : inputs) {
    if (!seen.insert(input.joints).second) {
      throw io::InputError(fmt::format("input \"{}\" is there twice; name it once", input.name));
    }
  }
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
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
  const double deviation = median({size_.begin(), size_.end()}) / (0.6745 * std::sqrt(20.0));
  return deviation * deviation;
}

Personal::Personal(Calibrated calibrated, InputMatrix inputs)
    : calibrated_(std::move(calibrated)),
      inputs_(std::move(inputs)),
      seen_(calibrated_.regression, inputs_, offset_deg_, {}),
      stranger_deg2_(scale_deg2(calibrated_, inputs_, 0)),
      acquainted_deg2_(stranger_deg2_) {}

void Personal::learn(const Hand& rest_deg, const std::vector<Hand>& hands) {
  offset_deg_ = calibrated_.regression.offset_deg(rest_deg);
  seen_ = Seen(calibrated_.regression, inputs_, offset_deg_, hands);
  if (hands.size() == seen_at_) return;
  seen_at_ = hands.size();
  acquainted_deg2_ = scale_deg2(calibrated_, inputs_, seen_at_);
}

Hand Personal::mean_deg(const VectorXd& inputs_deg) const {
  const VectorXd x = calibrated_.regression.scaled(inputs_deg, offset_deg_);
  return seen_.mean_deg(x, calibrated_.regression.with_cells(x));
}

Hand Personal::variance_deg2(const VectorXd& inputs_deg) const {
  const VectorXd x = calibrated_.regression.scaled(inputs_deg, offset_deg_);
  const Seen::Variance variance = seen_.variance(x, calibrated_.regression.with_cells(x));
  return (seen_.shown() > 0)
      .select(variance.shown * acquainted_deg2_, Hand(variance.hidden * stranger_deg2_));
}

Completer::Completer(const Posture& posture, std::vector<Input> inputs, bool rested)
    : posture_(posture),
      inputs_(std::move(inputs)),
      matrix_(input_matrix(inputs_)),
      shiver_(inputs_.size()),
      still_(inputs_.size()) {
  require_inputs(inputs_);
  for (const Person& person : posture.people) people_.push_back(&person);
  shape_ = choose_shape(people_, matrix_, rested);
  all_ = bit(inputs_.size()) - 1;
}

VectorXd Completer::picked(Mask mask, const VectorXd& of_all) const {
  std::vector<Index> rows;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (mask & bit(i)) rows.push_back(static_cast<Index>(i));
  }
  return of_all(rows);
}

Personal& Completer::model(Mask mask) {
  const auto it = models_.find(mask);
  if (it != models_.end()) return *it->second;
  if (models_.size() >= kMostModels) models_.clear();
  std::vector<Index> rows;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (mask & bit(i)) rows.push_back(static_cast<Index>(i));
  }
  const InputMatrix inputs = matrix_(rows, Eigen::all);
  auto made = std::make_unique<Personal>(calibrate(people_, inputs, shape_, matrix_), inputs);
  if (rest_rows_ > 0) made->learn(rest_sum_ / rest_rows_, seen_);
  return *models_.emplace(mask, std::move(made)).first->second;
}

void Completer::show(const Hand& hand_deg, double seconds) {
  const Hand rest = rest_sum_ / std::max(1.0, rest_rows_);
  const Hand away = (hand_deg - rest).abs();
  const Hand shown = (!away.isNaN()).cast<double>();
  const double away_deg = (shown > 0).select(away, Hand::Zero()).sum() / std::max(1.0, shown.sum());
  if (rest_rows_ > 0 && away_deg > kStill_deg) {
    see(hand_deg, seconds);
    return;
  }
  rest_sum_ += hand_deg;
  ++rest_rows_;
  for (auto& [mask, personal] : models_) personal->learn(rest_sum_ / rest_rows_, seen_);
}

// Mean hands of half a second each.
void Completer::see(const Hand& hand_deg, double seconds) {
  piece_sum_ += hand_deg;
  ++piece_rows_;
  piece_s_ += seconds;
  if (piece_s_ < kPiece_s || seen_.size() >= kMostPieces) return;
  seen_.push_back(piece_sum_ / piece_rows_);
  piece_sum_ = Hand::Zero();
  piece_rows_ = 0;
  piece_s_ = 0;
  for (auto& [mask, personal] : models_) personal->learn(rest_sum_ / rest_rows_, seen_);
}

Completer::Said Completer::from_others(const Readings& readings, std::size_t input) {
  const Mask others = readings.mask & ~bit(input);
  const Personal& personal = model(others);
  const auto row = static_cast<Index>(input);
  return {matrix_.row(row).dot(personal.mean_deg(picked(others, readings.value_deg)).matrix()),
          personal.calibrated().target_error_deg2[row], personal.calibrated().target_worst_deg[row]};
}

// A strip that lost its contact keeps one value to the last digit; a finger at rest does so too, but then the others say
// that it does. What is stuck stays so until it changes.
void Completer::leave_out_stuck(Readings& readings, std::vector<Quality>& quality) {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const Mask others = readings.mask & ~bit(i);
    const double reading = readings.value_deg[static_cast<Index>(i)];
    Still& still = still_[i];
    if (!(readings.mask & bit(i)) || others == 0) continue;
    const Said said = from_others(readings, i);
    if (still.rows == 0 || reading != still.reading_deg) {
      still = {reading, others, said.value_deg, 0, 1};
      continue;
    }
    if (still.others != others) {
      still.others = others;
      still.said_deg = said.value_deg;
    }
    still.moved_deg = std::max(still.moved_deg, std::abs(said.value_deg - still.said_deg));
    if (++still.rows < kStillRows || still.moved_deg < kStuck * std::sqrt(said.variance_deg2)) continue;
    quality[i] = Quality::stuck;
    readings.mask &= ~bit(i);
  }
}

void Completer::leave_out_implausible(Readings& readings, std::vector<Quality>& quality) {
  const auto leave_out = [&](std::size_t i) {
    quality[i] = Quality::implausible;
    readings.mask &= ~bit(i);
  };
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (!(readings.mask & bit(i))) continue;
    const auto row = static_cast<Index>(i);
    const double low = matrix_.row(row).dot(posture_.limits.low_deg.matrix());
    const double high = matrix_.row(row).dot(posture_.limits.high_deg.matrix());
    const double reading = readings.value_deg[row];
    if (reading < low - kBeyond_deg || reading > high + kBeyond_deg) leave_out(i);
  }
  for (;;) {  // the least plausible one first: it spoils what is said of the others
    std::size_t worst = inputs_.size();
    double most = kImplausible;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if (!(readings.mask & bit(i)) || readings.mask == bit(i)) continue;
      const Said said = from_others(readings, i);
      const double away =
          std::abs(readings.value_deg[static_cast<Index>(i)] - said.value_deg) / said.worst_deg;
      if (away <= most) continue;
      most = away;
      worst = i;
    }
    if (worst == inputs_.size()) return;
    leave_out(worst);
  }
}

// Up to kBeyond_deg, further is implausible.
void Completer::mark_beyond(Readings& readings, std::vector<Quality>& quality) const {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (!(readings.mask & bit(i))) continue;
    const auto row = static_cast<Index>(i);
    const double low = matrix_.row(row).dot(posture_.limits.low_deg.matrix());
    const double high = matrix_.row(row).dot(posture_.limits.high_deg.matrix());
    double& reading = readings.value_deg[row];
    if (reading >= low && reading <= high) continue;
    reading = std::clamp(reading, low, high);
    quality[i] = Quality::beyond;
  }
}

void Completer::weigh_noisy(Readings& readings, std::vector<Quality>& quality) {
  const Readings raw = readings;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const double noise_deg2 = shiver_[i].variance_deg2();
    if (!(raw.mask & bit(i)) || noise_deg2 < kNoisy_deg * kNoisy_deg || raw.mask == bit(i)) continue;
    const Said said = from_others(raw, i);
    const double share = said.variance_deg2 / (said.variance_deg2 + noise_deg2);
    const auto row = static_cast<Index>(i);
    readings.value_deg[row] = std::lerp(said.value_deg, raw.value_deg[row], share);
    readings.variance_deg2[row] = share * noise_deg2;
    quality[i] = Quality::noisy;
  }
}

// By how much the angles move when a noisy input does.
void Completer::add_noise(const Readings& readings, Hand& variance_deg2) {
  const Personal& personal = model(readings.mask);
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const auto row = static_cast<Index>(i);
    if (!(readings.mask & bit(i)) || readings.variance_deg2[row] == 0) continue;
    VectorXd up = readings.value_deg;
    VectorXd down = readings.value_deg;
    up[row] += std::sqrt(readings.variance_deg2[row]);
    down[row] -= std::sqrt(readings.variance_deg2[row]);
    const Hand change =
        personal.mean_deg(picked(readings.mask, up)) - personal.mean_deg(picked(readings.mask, down));
    variance_deg2 += (change / 2).square();
  }
}

bool Completer::sensed_alone(const Readings& readings, int joint) const {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (readings.mask & bit(i) && inputs_[i].joints == std::vector<int>{joint}) return true;
  }
  return false;
}

// The joints that are less certain give way more; one that meets its limit leaves the rest to the others.
void Completer::keep_sum(const std::vector<int>& joints, double sum_deg, Estimate& estimate) const {
  const auto& [low_deg, high_deg] = posture_.limits;
  std::vector<int> free = joints;
  for (const int joint : joints) {
    estimate.angle_deg[joint] = std::clamp(estimate.angle_deg[joint], low_deg[joint], high_deg[joint]);
  }
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
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (!(readings.mask & bit(i))) continue;
    const auto row = static_cast<Index>(i);
    const std::vector<int>& joints = inputs_[i].joints;
    keep_sum(joints, readings.value_deg[row], estimate);
    if (joints.size() > 1) continue;
    estimate.se_deg[joints[0]] = std::max(kLeast_deg, std::sqrt(readings.variance_deg2[row]));
  }
}

void Completer::set_coupled(const Readings& readings, Estimate& estimate) const {
  for (const CoupledCurve& curve : posture_.curves) {
    const auto [joint, follows] = curve.coupling;
    if (!sensed_alone(readings, follows) || sensed_alone(readings, joint)) continue;
    const double angle = estimate.angle_deg[follows];
    const double se = estimate.se_deg[follows];
    const double through = (curve.at(angle + se) - curve.at(angle - se)) / 2;
    estimate.angle_deg[joint] = curve.at(angle);
    estimate.se_deg[joint] = std::max(kLeastCoupled_deg, std::hypot(curve.sd_deg, through));
  }
}

Estimate Completer::complete(const VectorXd& readings_deg) {
  Estimate estimate;
  estimate.quality.assign(inputs_.size(), Quality::used);
  Readings readings{readings_deg, VectorXd::Zero(readings_deg.size()), all_};
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const double reading = readings_deg[static_cast<Index>(i)];
    shiver_[i].push(reading);
    if (!std::isnan(reading)) continue;
    estimate.quality[i] = Quality::missing;
    readings.mask &= ~bit(i);
  }
  leave_out_implausible(readings, estimate.quality);
  leave_out_stuck(readings, estimate.quality);
  mark_beyond(readings, estimate.quality);
  weigh_noisy(readings, estimate.quality);
  const Personal& personal = model(readings.mask);
  const VectorXd inputs = picked(readings.mask, readings.value_deg);
  estimate.angle_deg = personal.mean_deg(inputs);
  Hand variance_deg2 = personal.variance_deg2(inputs);
  add_noise(readings, variance_deg2);
  estimate.se_deg = variance_deg2.max(kLeast_deg * kLeast_deg).sqrt();
  set_sensed(readings, estimate);
  set_coupled(readings, estimate);
  estimate.angle_deg = estimate.angle_deg.max(posture_.limits.low_deg).min(posture_.limits.high_deg);
  return estimate;
}

}  // namespace flexor::posture
