// Sensors that are followed while the glove is worn (runtime/sensor/tracker.hpp), or not. The same code on the glove and
// on a PC. What is found lives in RAM: a glove that is put on is another glove, and EEPROM wears.
#pragma once

#include "runtime/sensor/tracker.hpp"

namespace flexor {
namespace glove {

using Tracking = sensor::FixedTracking;
using TrackedSensor = sensor::TrackedSensor<Tracking>;
using TrackerSettings = sensor::TrackerSettings<Tracking>;

struct NotFollowed {
  void reset() {}
  void next_sample() {}
  int16_t step(uint8_t, int16_t alpha, bool) { return alpha; }
};

template <uint8_t kSensors>
class Follower {
 public:
  // `sensors`: kSensors of them, in flash on the microcontroller; both outlive this object.
  Follower(const TrackerSettings& settings, const TrackedSensor* sensors, uint8_t samples_per_tick)
      : settings_(settings), sensors_(sensors), samples_per_tick_(samples_per_tick) {
    reset();
  }

  // Whether `sensors` are what the model was made for.
  void follow(bool on) {
    is_on_ = on;
    reset();
  }

  // Nothing is found yet: the sensors have been zeroed.
  void reset() {
    for (sensor::Tracker<Tracking>& tracker : tracker_) tracker.reset(settings_);
  }

  // Before the sensors' readings of a sample.
  void next_sample() {
    tick_ = until_ == 0;
    until_ = tick_ ? static_cast<uint8_t>(samples_per_tick_ - 1) : static_cast<uint8_t>(until_ - 1);
  }

  int16_t step(uint8_t i, int16_t alpha, bool alive) {
    const TrackedSensor sensor = {core::table(sensors_[i].middle), core::table(sensors_[i].half),
                                  core::table(sensors_[i].noise), core::table(sensors_[i].max_step),
                                  core::table(sensors_[i].per_half)};
    if (sensor.half == 0 || !is_on_) return alpha;
    const int16_t corrected = tracker_[i].corrected(sensor, alpha);
    if (tick_ && alive) tracker_[i].observe(settings_, sensor, alpha);
    return corrected;
  }

 private:
  const TrackerSettings& settings_;
  const TrackedSensor* sensors_;
  uint8_t samples_per_tick_;
  bool is_on_ = true;
  uint8_t until_ = 0;
  bool tick_ = false;
  sensor::Tracker<Tracking> tracker_[kSensors];
};

}  // namespace glove
}  // namespace flexor
