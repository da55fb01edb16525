#include "host/model/tracking.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/io/numbers.hpp"

namespace flexor::model {
namespace {

constexpr double kLeastHalf = 33.0 / 32;  // of a range in Q5
constexpr double kMostHalf = 16383.0 / 32;
constexpr double kMostNoise = 511.0 / 32;

// A number in an arithmetic's fraction, at least one step of it.
template <class Number>
Number in_fraction(double value, int fraction) {
  if constexpr (std::is_floating_point_v<Number>) {
    return static_cast<Number>(value);
  } else {
    constexpr double kMost = std::numeric_limits<Number>::max();
    return static_cast<Number>(std::lround(std::clamp(std::ldexp(value, fraction), 1.0, kMost)));
  }
}

double square(double x) { return x * x; }

using Doubles = sensor::RealTracking<double>;

struct Bends {
  std::vector<double> middle;
  std::vector<double> half;
};

Bends whole_bends(const std::vector<std::vector<double>>& recordings, double sample_period_s,
                  const Poses& poses) {
  const TrackedRange range{poses, 1, 0, 0};
  const auto sensor = tracked_from<Doubles>(range, {});
  const std::size_t every = static_cast<std::size_t>(samples_per_tick(sample_period_s));
  Bends out;
  for (const std::vector<double>& readings : recordings) {
    sensor::Tracker<Doubles> tracker;
    for (std::size_t k = 0; k < readings.size(); k += every) {
      tracker.observe({}, sensor, readings[k]);
      if (!tracker.has_bend()) continue;
      out.middle.push_back(tracker.bend_middle());
      out.half.push_back(tracker.bend_half());
    }
  }
  return out;
}

std::int16_t number_of(double reading, const sensor::Tracker<sensor::FixedTracking>&) {
  return static_cast<std::int16_t>(std::lround(32 * std::clamp(reading, -1024.0, 1023.96875)));
}
template <class Real>
Real number_of(double reading, const sensor::Tracker<sensor::RealTracking<Real>>&) {
  return static_cast<Real>(reading);
}

template <class Number>
double in_units(Number reading) {
  return std::is_floating_point_v<Number> ? static_cast<double>(reading) : static_cast<double>(reading) / 32;
}

}  // namespace

std::vector<std::optional<TrackedRange>> tracked_ranges(const Model& model, bool watched) {
  const Graph graph(model);
  std::vector<std::optional<TrackedRange>> out(model.inputs.size());
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const Input& input = model.inputs[i];
    if (!input.poses && !input.turns) continue;
    const Poses poses = input.turns ? *input.turns : *input.poses;
    const double half = std::abs(poses.fist - poses.open) / 2;
    if (half < kLeastHalf || half > kMostHalf) continue;
    const auto reads = [&](const std::vector<std::size_t>& inputs) {
      return inputs.size() > 1 && std::ranges::find(inputs, i) != inputs.end();
    };
    if (!watched && std::ranges::any_of(graph.joint, [&](std::size_t at) { return reads(graph.inputs[at]); }))
      continue;
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      if (std::ranges::find(graph.inputs[graph.joint[j]], i) == graph.inputs[graph.joint[j]].end()) continue;
      const Saturation& range = limits(model, model.joints[j]);
      out[i] = {poses, range.upper_deg - range.lower_deg, input.valid_min, input.valid_max};
      break;
    }
  }
  return out;
}

std::optional<Poses> turns_of(const std::vector<std::vector<double>>& recordings, double sample_period_s,
                              const Poses& poses) {
  constexpr std::size_t kLeast = 3;
  Poses turns = poses;
  for (int round = 0; round < 2; ++round) {  // which bends are whole depends on where they turn
    const Bends bends = whole_bends(recordings, sample_period_s, turns);
    if (bends.half.size() < kLeast) return {};
    const double middle = io::median(bends.middle);
    const double half = std::copysign(io::median(bends.half), poses.fist - poses.open);
    turns = {middle - half, middle + half};
  }
  return turns;
}

template <class A>
sensor::TrackerSettings<A> tracker_settings(const TrackingPrior& prior) {
  // At the end of a range of 83 degrees, the hand's; a stretch is none of degrees.
  constexpr double kHalf_deg = 41.5;
  constexpr double kTicksPerMinute = 60.0 * sensor::kTicks_hz;
  const double noise = square(prior.bend_deg);
  return {in_fraction<typename A::Variance>(std::min(square(prior.shift_deg) / noise, 250.0), 8),
          in_fraction<typename A::Variance>(std::min(square(prior.stretch * kHalf_deg) / noise, 250.0), 8),
          in_fraction<typename A::Growth>(square(prior.drift_deg_per_min) / noise / kTicksPerMinute, 16)};
}

template <class A>
sensor::TrackedSensor<A> tracked_from(const std::optional<TrackedRange>& range, const TrackingPrior& prior) {
  using Reading = typename A::Reading;
  if (!range) return {};
  const double half = std::abs(range->poses.fist - range->poses.open) / 2;
  const double per_deg = 2 * half / range->range_deg;
  const double middle = (range->poses.fist + range->poses.open) / 2;
  sensor::TrackedSensor<A> out{};
  if constexpr (std::is_floating_point_v<Reading>) {
    out.middle = static_cast<Reading>(middle);
    out.per_half = static_cast<Reading>(1 / half);
  } else {
    out.middle = static_cast<Reading>(std::lround(std::clamp(32 * middle, -32767.0, 32767.0)));
    out.per_half = static_cast<std::uint16_t>(std::lround(std::ldexp(1 / half, 16)));
  }
  out.half = in_fraction<Reading>(half, 5);
  out.noise = in_fraction<Reading>(std::min(prior.bend_deg * per_deg, kMostNoise), 5);
  out.max_step = in_fraction<Reading>(prior.quickest_deg_s * per_deg / sensor::kTicks_hz, 5);
  return out;
}

int samples_per_tick(double sample_period_s) {
  return std::max(1, static_cast<int>(std::lround(1 / sample_period_s / sensor::kTicks_hz)));
}

template <class Arithmetic>
Trackers<Arithmetic>::Trackers(const Model& model, const TrackingPrior& prior, bool watched)
    : prior_(prior),
      settings_(tracker_settings<A>(prior)),
      corrected_(model.inputs.size()),
      every_(samples_per_tick(model.sample_period_s)) {
  const std::vector<std::optional<TrackedRange>> ranges = tracked_ranges(model, watched);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    inputs_.push_back({model.inputs[i].name, ranges[i], tracked_from<A>(ranges[i], prior), {}});
    inputs_.back().tracker.reset(settings_);
  }
}

template <class Arithmetic>
std::span<const double> Trackers<Arithmetic>::step(std::span<const double> reading, bool pause) {
  const bool tick = until_ == 0;
  until_ = (until_ + 1) % every_;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    One& one = inputs_[i];
    corrected_[i] = reading[i];
    if (!one.range || !std::isfinite(reading[i])) continue;
    const auto x = number_of(reading[i], one.tracker);
    corrected_[i] = in_units(one.tracker.corrected(one.tracked, x));
    const bool alive = corrected_[i] >= one.range->valid_min && corrected_[i] <= one.range->valid_max;
    if (!tick || pause || !alive) continue;
    one.tracker.observe(settings_, one.tracked, x);
    one.alarmed = one.alarmed || one.tracker.alarm();
  }
  return corrected_;
}

template <class Arithmetic>
bool Trackers<Arithmetic>::any() const {
  return std::ranges::any_of(inputs_, [](const One& one) { return one.range.has_value(); });
}

template <class Arithmetic>
std::vector<Followed> Trackers<Arithmetic>::followed() const {
  std::vector<Followed> out;
  for (const One& one : inputs_) {
    Followed& f = out.emplace_back();
    f.input = one.input;
    f.is_tracked = one.range.has_value();
    if (!f.is_tracked) continue;
    const double deg_per_unit = one.range->range_deg / (one.range->poses.fist - one.range->poses.open);
    const double one_variance = std::is_floating_point_v<typename A::Variance> ? 1 : 256;
    const double one_ratio = std::is_floating_point_v<typename A::Ratio> ? 1 : 1 << 14;
    f.shift_deg = in_units(one.tracker.shift()) * deg_per_unit;
    f.standard_error_deg =
        prior_.bend_deg * std::sqrt(static_cast<double>(one.tracker.shift_variance()) / one_variance);
    f.stretch = static_cast<double>(one.tracker.stretch()) / one_ratio;
    f.alarmed = one.alarmed;
  }
  return out;
}

template class Trackers<FixedArithmetic>;
template class Trackers<FloatArithmetic>;
template class Trackers<DoubleArithmetic>;

template sensor::TrackerSettings<sensor::FixedTracking> tracker_settings(const TrackingPrior&);
template sensor::TrackedSensor<sensor::FixedTracking> tracked_from(const std::optional<TrackedRange>&,
                                                                   const TrackingPrior&);

}  // namespace flexor::model
