#include "host/model/tracking.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "host/model/channel.hpp"

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

}  // namespace

std::vector<std::optional<TrackedRange>> tracked_ranges(const Model& model) {
  const Graph graph(model);
  std::vector<std::optional<TrackedRange>> out(model.inputs.size());
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    if (!model.inputs[i].poses) continue;
    const Poses poses = *model.inputs[i].poses;
    const double half = std::abs(poses.fist - poses.open) / 2;
    if (half < kLeastHalf || half > kMostHalf) continue;
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      if (std::ranges::find(graph.inputs[graph.joint[j]], i) == graph.inputs[graph.joint[j]].end()) continue;
      const Saturation& range = limits(model, model.joints[j]);
      out[i] = {poses, range.upper_deg - range.lower_deg};
      break;
    }
  }
  return out;
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
sensor::TrackedStrip<A> tracked_strip(const std::optional<TrackedRange>& range, const TrackingPrior& prior) {
  using Reading = typename A::Reading;
  if (!range) return {};
  const double half = std::abs(range->poses.fist - range->poses.open) / 2;
  const double per_deg = 2 * half / range->range_deg;
  const double middle = (range->poses.fist + range->poses.open) / 2;
  sensor::TrackedStrip<A> out{};
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

template sensor::TrackerSettings<sensor::FixedTracking> tracker_settings(const TrackingPrior&);
template sensor::TrackerSettings<sensor::RealTracking<double>> tracker_settings(const TrackingPrior&);
template sensor::TrackedStrip<sensor::FixedTracking> tracked_strip(const std::optional<TrackedRange>&,
                                                                   const TrackingPrior&);
template sensor::TrackedStrip<sensor::RealTracking<double>> tracked_strip(const std::optional<TrackedRange>&,
                                                                          const TrackingPrior&);

}  // namespace flexor::model
