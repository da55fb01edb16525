// What the tracker of a worn glove (runtime/sensor/tracker.hpp) starts from: a sensor's poses as the model has them, and
// how far donnings and drift are expected to take it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "host/model/compensator.hpp"
#include "host/model/model.hpp"
#include "runtime/sensor/tracker.hpp"

namespace flexor::model {

// Standard deviations, at the joint.
struct TrackingPrior {
  double shift_deg = 8;   // of the offset between donnings
  double stretch = 0.08;  // of the gain
  double drift_deg_per_min = 4;
  double bend_deg = 2;        // of where the middle of a whole bend lies
  double quickest_deg_s = 2;  // the shift follows by no more; not a deviation
};

// Of one sensor: its poses, the degrees from one to the other, and what of a corrected reading is the hand's.
struct TrackedRange {
  Poses poses;
  double range_deg = 0;  // above 0
  double valid_min = 0;
  double valid_max = 0;
};

// Where a sensor turns in whole bends, as a tracker sees it: the medians over `readings`, sample by sample of one period.
// `poses`: what it reads at the open hand and at the fist, about. None of fewer than three whole bends.
std::optional<Poses> turns_of(const std::vector<std::vector<double>>& recordings, double sample_period_s,
                              const Poses& poses);

// Of each input, by where it turns or, where the model has no turns, by its poses: none without either, or where they are too near to each other for readings in Q5.
// Sensors that other fingers turn too, whose joints read several, are there to be watched alone.
std::vector<std::optional<TrackedRange>> tracked_ranges(const Model& model, bool watched = false);

template <class A>
sensor::TrackerSettings<A> tracker_settings(const TrackingPrior& prior);

template <class A>
sensor::TrackedSensor<A> tracked_from(const std::optional<TrackedRange>& range, const TrackingPrior& prior);

extern template sensor::TrackerSettings<sensor::FixedTracking> tracker_settings(const TrackingPrior&);
extern template sensor::TrackedSensor<sensor::FixedTracking> tracked_from(const std::optional<TrackedRange>&,
                                                                          const TrackingPrior&);

// Samples a tick.
int samples_per_tick(double sample_period_s);

// What one input was corrected by at the end.
struct Followed {
  std::string input;
  bool is_tracked = false;  // else nothing below is given
  double shift_deg = 0;     // of the joint, at the middle of its range; above 0: more bent
  double standard_error_deg = 0;
  double stretch = 0;    // share of the range
  bool alarmed = false;  // it once drifted more quickly than it is followed
};

// The trackers of a model's inputs, as the glove has them: in its fixed point, in float or in double.
template <class Arithmetic>
class Trackers {
 public:
  Trackers(const Model& model, const TrackingPrior& prior, bool watched = false);

  // One sample of each input, in the model's units and at its rate, corrected; valid until the next call. What lies
  // outside of the input's valid range when corrected is a sensor's fault: nothing is learnt from it, nor in a pause.
  std::span<const double> step(std::span<const double> reading, bool pause);

  bool any() const;  // is tracked
  std::vector<Followed> followed() const;

 private:
  using A = std::conditional_t<std::is_same_v<typename Arithmetic::Number, std::int16_t>,
                               sensor::FixedTracking, sensor::RealTracking<typename Arithmetic::Number>>;
  struct One {
    std::string input;
    std::optional<TrackedRange> range;
    sensor::TrackedSensor<A> tracked;
    sensor::Tracker<A> tracker;
    bool alarmed = false;
  };

  TrackingPrior prior_;
  sensor::TrackerSettings<A> settings_;
  std::vector<One> inputs_;
  std::vector<double> corrected_;
  int every_ = 1;  // samples a tick
  int until_ = 0;
};

extern template class Trackers<FixedArithmetic>;
extern template class Trackers<FloatArithmetic>;
extern template class Trackers<DoubleArithmetic>;

}  // namespace flexor::model
