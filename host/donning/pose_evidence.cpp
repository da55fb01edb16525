#include "host/donning/pose_evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/donning/still_map.hpp"
#include "host/io/io.hpp"

namespace flexor::donning {
namespace {

constexpr double kPose_deg = 5;
constexpr double kMostPoseError = 0.3;    // of the span, where the joint hardly moves
constexpr double kNotReached = 0.5;       // of what the poses were apart, by one sensor
constexpr double kUsuallyReached = 0.75;  // by most
constexpr double kUnmoved = 0.15;
constexpr double kStill_s = 1;
constexpr double kMedian_s = 0.5;
constexpr double kStill = 0.125;  // of the span: the range of what rests
constexpr double kApart = 0.3;    // of the span: holds that are nearer are one

struct Held {
  std::optional<double> open;
  std::optional<double> fist;
};

Held held(const std::vector<Hold>& holds, std::size_t sensor, bool swapped) {
  Held out;
  for (const Hold& hold : holds) {
    if (std::isnan(hold.reading[sensor])) continue;
    (hold.fist != swapped ? out.fist : out.open) = hold.reading[sensor];
  }
  return out;
}

double wanted(const model::Poses& poses) { return poses.fist - poses.open; }

// More sensors read the two poses the other way round than not.
bool are_swapped(const model::Model& model, const std::vector<Hold>& holds) {
  int turned = 0;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const Held h = held(holds, i, false);
    if (!h.open || !h.fist || !model.inputs[i].poses) continue;
    const double share = (*h.fist - *h.open) / wanted(*model.inputs[i].poses);
    turned += share < -kNotReached ? 1 : share > 0 ? -1 : 0;
  }
  return turned > 0;
}

double pose_error(const model::Model& model, std::size_t sensor) {
  double most_deg = 0;
  for (const double range : ranges_deg(model, sensor)) most_deg = std::max(most_deg, range);
  return most_deg > 0 ? std::min(kMostPoseError, kPose_deg / most_deg) : kMostPoseError;
}

struct Ends {
  Held held;
  double share = 0;  // of what the poses were apart where the model was made
};

// Most sensors that were held in both poses and moved: how far they went.
double usual_share(const std::vector<Ends>& all) {
  std::vector<double> shares;
  for (const Ends& one : all) {
    if (one.held.open && one.held.fist && std::abs(one.share) > kUnmoved) shares.push_back(one.share);
  }
  if (shares.empty()) return 0;
  const auto middle = shares.begin() + std::ssize(shares) / 2;
  std::ranges::nth_element(shares, middle);
  return *middle;
}

// The end that was not reached is the one that fits worse, all sensors together.
bool fist_was_reached(const model::Model& model, const std::vector<Ends>& all) {
  double open = 0;
  double fist = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Held& h = all[i].held;
    if (!h.open || !h.fist || !model.inputs[i].poses || std::abs(all[i].share) <= kUnmoved) continue;
    const model::Poses& made = *model.inputs[i].poses;
    open += std::abs((*h.open - made.open) / wanted(made));
    fist += std::abs((*h.fist - made.fist) / wanted(made));
  }
  return fist < open;
}

void read_sensor(const model::Model& model, std::size_t i, const std::vector<Ends>& all, PoseReading& out) {
  const model::Input& input = model.inputs[i];
  if (!input.poses) return;
  const double error = pose_error(model, i);
  Held h = all[i].held;
  if (h.open && h.fist) {
    const double share = all[i].share;
    if (share < -kUnmoved) {
      out.misfits.emplace_back(
          i, fmt::format("{}: it moves the other way than where the model was made: is its strip turned?",
                         input.name));
      return;
    }
    const double usual = usual_share(all);
    if (share < kUnmoved && usual > 2 * kUnmoved) {
      out.misfits.emplace_back(i, fmt::format("{}: it stands still at {:.4g} where the others moved: is it "
                                              "plugged in, is its strip whole, was it bent?",
                                              input.name, *h.open));
      return;
    }
    if (share < kNotReached || usual < kUsuallyReached) {
      const bool fist_fits = fist_was_reached(model, all);
      (fist_fits ? h.open : h.fist).reset();
      out.notes.push_back(fmt::format("{}: its {} was not reached and does not count", input.name,
                                      fist_fits ? "open hand" : "fist"));
    }
  }
  if (h.open) out.sightings.push_back({i, *h.open, input.poses->open, error});
  if (h.fist) out.sightings.push_back({i, *h.fist, input.poses->fist, error});
}

}  // namespace

PoseReading read_poses(const model::Model& model, const std::vector<Hold>& holds,
                       const std::vector<model::Spread>&) {
  if (std::ranges::none_of(model.inputs, [](const auto& input) { return input.poses.has_value(); }))
    throw io::InputError(
        "the model does not say what its sensors read at the open hand and at the fist: identify it anew");
  PoseReading out;
  const bool swapped = are_swapped(model, holds);
  if (swapped) out.notes.emplace_back("open hand and fist were held the other way round: taken so");
  std::vector<Ends> all;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    Ends& one = all.emplace_back();
    one.held = held(holds, i, swapped);
    if (one.held.open && one.held.fist && model.inputs[i].poses)
      one.share = (*one.held.fist - *one.held.open) / wanted(*model.inputs[i].poses);
  }
  for (std::size_t i = 0; i < model.inputs.size(); ++i) read_sensor(model, i, all, out);
  return out;
}

namespace {

struct Rest {
  std::size_t begin;
  std::size_t end;
  std::vector<double> reading;

  std::size_t length() const { return end - begin; }
};

double mean(const std::vector<double>& readings, std::size_t begin, std::size_t end) {
  double sum = 0;
  for (std::size_t k = begin; k < end; ++k) sum += readings[k];
  return sum / static_cast<double>(end - begin);
}

// The running median over kMedian_s: neither a loose contact's spike nor a tremor ends a hold.
std::vector<double> steadied(const std::vector<double>& readings, double period_s) {
  const auto half = static_cast<std::size_t>(kMedian_s / period_s / 2);
  std::vector<double> out;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const std::size_t begin = k - std::min(k, half);
    std::vector<double> window(
        readings.begin() + static_cast<std::ptrdiff_t>(begin),
        readings.begin() + static_cast<std::ptrdiff_t>(std::min(k + half + 1, readings.size())));
    const auto middle = window.begin() + std::ssize(window) / 2;
    std::ranges::nth_element(window, middle);
    out.push_back(*middle);
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
      if (high - low > kStill * made[i].span()) end = k;
    }
  }
  return end;
}

double apart(const Rest& a, const Rest& b, const std::vector<model::Spread>& made) {
  double most = 0;
  for (std::size_t i = 0; i < made.size(); ++i)
    most = std::max(most, std::abs(a.reading[i] - b.reading[i]) / made[i].span());
  return most;
}

std::vector<Rest> rests_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made) {
  const auto least = static_cast<std::size_t>(std::ceil(kStill_s / period_s));
  std::vector<Rest> out;
  for (std::size_t k = 0; k < readings.front().size();) {
    const std::size_t end = still_until(readings, k, made);
    if (end - k < least) {
      ++k;
      continue;
    }
    Rest rest{k, end, {}};
    for (const auto& one : readings) rest.reading.push_back(mean(one, k, end));
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

std::vector<Hold> holds_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made, const std::vector<bool>& fist) {
  std::vector<std::vector<double>> steady;
  for (const auto& one : readings) steady.push_back(steadied(one, period_s));
  std::vector<Rest> rests = rests_in(steady, period_s, made);
  if (rests.size() < fist.size()) return {};
  // The longest ones, in their order in time.
  std::ranges::stable_sort(rests, std::ranges::greater(), &Rest::length);
  rests.resize(fist.size());
  std::ranges::sort(rests, {}, &Rest::begin);
  std::vector<Hold> out;
  for (std::size_t i = 0; i < fist.size(); ++i) out.push_back({fist[i], rests[i].reading});
  return out;
}

}  // namespace flexor::donning
