#include "host/identify/pose_evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "host/identify/still_map.hpp"

namespace flexor::identify {
namespace {

constexpr double kPose_deg = 5;
constexpr double kMostPoseError = 0.3;    // of the span, where the joint hardly moves
constexpr double kNotReached = 0.5;       // of what the poses were apart, by one sensor
constexpr double kUsuallyReached = 0.75;  // by most
constexpr double kUnmoved = 0.15;
constexpr double kStill_s = 1;
constexpr double kMedian_s = 0.5;
constexpr double kHeldStill = 0.125;  // of the span: the range of what rests
constexpr double kApart = 0.3;        // of the span: holds that are nearer are one

double between(const model::Poses& poses) { return poses.fist - poses.open; }

// What one sensor reads in either pose.
struct Ends {
  std::optional<double> open;
  std::optional<double> fist;
  double share = 0;  // of what the poses were apart where the model was made

  bool both() const { return open && fist; }
  bool moved() const { return both() && std::abs(share) > kUnmoved; }
};

std::vector<Ends> ends_of(const model::Model& model, const std::vector<Hold>& holds, bool swapped) {
  std::vector<Ends> out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    Ends& one = out.emplace_back();
    if (!model.inputs[i].poses) continue;
    for (const Hold& hold : holds) {
      if (!std::isnan(hold.reading[i])) (hold.fist != swapped ? one.fist : one.open) = hold.reading[i];
    }
    if (one.both()) one.share = (*one.fist - *one.open) / between(*model.inputs[i].poses);
  }
  return out;
}

// More sensors read the two poses the other way round than not.
bool are_swapped(const std::vector<Ends>& all) {
  int turned = 0;
  for (const Ends& one : all) turned += one.share < -kUnmoved ? 1 : one.share > 0 ? -1 : 0;
  return turned > 0;
}

double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Most sensors that were held in both poses and moved: how far they went.
double usual_share(const std::vector<Ends>& all) {
  std::vector<double> shares;
  for (const Ends& one : all) {
    if (one.moved()) shares.push_back(one.share);
  }
  return shares.empty() ? 0 : middle_of(std::move(shares));
}

// The end that was not reached is the one that fits worse, all sensors together.
bool fist_was_reached(const model::Model& model, const std::vector<Ends>& all) {
  double open = 0;
  double fist = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].moved()) continue;
    const model::Poses& made = *model.inputs[i].poses;
    open += std::abs((*all[i].open - made.open) / between(made));
    fist += std::abs((*all[i].fist - made.fist) / between(made));
  }
  return fist < open;
}

// A strip that no donning explains, where most others moved from pose to pose.
std::string misfit_of(const model::Input& input, const Ends& ends) {
  if (!ends.both()) return {};
  if (ends.share < -kUnmoved) {
    return fmt::format("{}: it moves the other way than where the model was made: is its strip turned?",
                       input.name);
  }
  if (ends.share < kUnmoved) {
    return fmt::format(
        "{}: it stands still at {:.4g} where the others moved: is it plugged in, is its strip whole, "
        "was it bent?",
        input.name, *ends.open);
  }
  return {};
}

void read_sensor(const model::Model& model, std::size_t i, const Ends& ends, bool fist_counts,
                 PoseReading& out, std::vector<std::string>& notes) {
  const model::Input& input = model.inputs[i];
  if (!input.poses) return;
  if (std::string misfit = misfit_of(input, ends); !misfit.empty()) {
    out.misfits.emplace_back(i, std::move(misfit));
    return;
  }
  const double most_deg = reach_of(model, i).most_deg;
  const double error = most_deg > 0 ? std::min(kMostPoseError, kPose_deg / most_deg) : kMostPoseError;
  const double pose = between(*input.poses) / input.readings->span();
  if (ends.open) out.sightings.push_back({i, *ends.open, input.poses->open, error, pose, false});
  if (!ends.fist) return;
  if (!fist_counts || (ends.both() && ends.share < kNotReached)) {
    notes.push_back(fmt::format("{}: its fist was not reached and does not count", input.name));
    return;
  }
  out.sightings.push_back({i, *ends.fist, input.poses->fist, error, pose, true});
}

struct HeldPose {
  std::size_t begin;
  std::size_t end;
  std::vector<double> reading;

  std::size_t length() const { return end - begin; }
};

// The running median over kMedian_s: neither a loose contact's spike nor a tremor ends a hold.
std::vector<double> steadied(const std::vector<double>& readings, double period_s) {
  const auto half = static_cast<std::size_t>(kMedian_s / period_s / 2);
  std::vector<double> out;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const std::size_t end = std::min(k + half + 1, readings.size());
    out.push_back(middle_of({readings.data() + (k - std::min(k, half)), readings.data() + end}));
  }
  return out;
}

// The longest stretch from `begin` on in which no sensor moves.
std::size_t still_until(const std::vector<std::vector<double>>& readings, std::size_t begin,
                        const std::vector<model::Spread>& made) {
  std::size_t end = readings.front().size();
  for (std::size_t i = 0; i < readings.size(); ++i) {
    double low = readings[i][begin];
    double high = low;
    for (std::size_t k = begin; k < end; ++k) {
      low = std::min(low, readings[i][k]);
      high = std::max(high, readings[i][k]);
      if (high - low > kHeldStill * made[i].span()) end = k;
    }
  }
  return end;
}

double apart(const HeldPose& a, const HeldPose& b, const std::vector<model::Spread>& made) {
  double most = 0;
  for (std::size_t i = 0; i < made.size(); ++i)
    most = std::max(most, std::abs(a.reading[i] - b.reading[i]) / made[i].span());
  return most;
}

std::vector<HeldPose> rests_in(const std::vector<std::vector<double>>& readings, double period_s,
                               const std::vector<model::Spread>& made) {
  const auto least = static_cast<std::size_t>(std::ceil(kStill_s / period_s));
  std::vector<HeldPose> out;
  for (std::size_t k = 0; k < readings.front().size();) {
    const std::size_t end = still_until(readings, k, made);
    if (end - k < least) {
      ++k;
      continue;
    }
    HeldPose rest{k, end, {}};
    for (const auto& one : readings)
      rest.reading.push_back(std::accumulate(one.data() + k, one.data() + end, 0.0) /
                             static_cast<double>(end - k));
    if (!out.empty() && apart(out.back(), rest, made) < kApart) {
      if (rest.length() > out.back().length()) out.back() = rest;
    } else {
      out.push_back(std::move(rest));
    }
    k = end;
  }
  return out;
}

}  // namespace

PoseReading read_poses(const RecalibrationRequest& request, Recalibration& said) {
  const model::Model& model = request.model;
  PoseReading out;
  std::vector<Ends> all = ends_of(model, request.holds, false);
  if (are_swapped(all)) {
    said.notes.emplace_back("open hand and fist were held the other way round: taken so");
    all = ends_of(model, request.holds, true);
  }
  const auto live = std::ranges::count_if(all, &Ends::both);
  const auto moved = std::ranges::count_if(all, &Ends::moved);
  if (live > 0 && 2 * moved <= live) {
    said.wanted.push_back(fmt::format(
        "open hand and fist with all fingers: {} of {} sensors moved from one to the other", moved, live));
    return out;
  }
  const bool closed = live == 0 || usual_share(all) >= kUsuallyReached;
  if (!closed && fist_was_reached(model, all)) {
    said.wanted.emplace_back(
        "open hand and fist once more, the hand wholly open and wholly closed: they lie too near to each "
        "other to say which of them was not reached");
    return out;
  }
  if (!closed)
    said.wanted.emplace_back("the fist once more, wholly closed: it was not reached and does not count");
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    read_sensor(model, i, all[i], closed, out, said.notes);
  return out;
}

std::vector<Hold> holds_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made, const std::vector<bool>& fist) {
  std::vector<std::vector<double>> steady;
  for (const auto& one : readings) steady.push_back(steadied(one, period_s));
  std::vector<HeldPose> rests = rests_in(steady, period_s, made);
  if (rests.size() < fist.size()) return {};
  // The longest ones, in their order in time.
  std::ranges::stable_sort(rests, std::ranges::greater(), &HeldPose::length);
  rests.resize(fist.size());
  std::ranges::sort(rests, {}, &HeldPose::begin);
  std::vector<Hold> out;
  for (std::size_t i = 0; i < fist.size(); ++i) out.push_back({fist[i], rests[i].reading});
  return out;
}

}  // namespace flexor::identify
