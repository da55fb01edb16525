// What the tracker of a worn glove (runtime/sensor/tracker.hpp) starts from: a strip's poses as the model has them, and
// how far donnings and drift are expected to take it.
#pragma once

#include <optional>
#include <vector>

#include "host/model/model.hpp"
#include "runtime/sensor/tracker.hpp"

namespace flexor::model {

// Standard deviations, at the joint.
struct TrackingPrior {
  double shift_deg = 8;   // of the offset between donnings
  double stretch = 0.08;  // of the gain
  double drift_deg_per_min = 4;
  double bend_deg = 1.3;      // of where the middle of a whole bend lies
  double quickest_deg_s = 2;  // the shift follows by no more; not a deviation
};

// Of one strip: its poses, and the degrees from one to the other.
struct TrackedRange {
  Poses poses;
  double range_deg = 0;  // above 0
};

// Of each input: none without poses, or where they are too near to each other for readings in Q5.
std::vector<std::optional<TrackedRange>> tracked_ranges(const Model& model);

template <class A>
sensor::TrackerSettings<A> tracker_settings(const TrackingPrior& prior);

template <class A>
sensor::TrackedStrip<A> tracked_strip(const std::optional<TrackedRange>& range, const TrackingPrior& prior);

extern template sensor::TrackerSettings<sensor::FixedTracking> tracker_settings(const TrackingPrior&);
extern template sensor::TrackerSettings<sensor::RealTracking<double>> tracker_settings(const TrackingPrior&);
extern template sensor::TrackedStrip<sensor::FixedTracking> tracked_strip(const std::optional<TrackedRange>&,
                                                                          const TrackingPrior&);
extern template sensor::TrackedStrip<sensor::RealTracking<double>> tracked_strip(
    const std::optional<TrackedRange>&, const TrackingPrior&);

}  // namespace flexor::model
