// Strips that are followed while the glove is worn (runtime/sensor/tracker.hpp), or not. The same code on the glove and
// on a PC. What is found lives in RAM: a glove that is put on is another glove, and EEPROM wears.
#pragma once

#include "runtime/sensor/tracker.hpp"

namespace flexor {
namespace glove {

using Tracking = sensor::FixedTracking;
using TrackedStrip = sensor::TrackedStrip<Tracking>;
using TrackerSettings = sensor::TrackerSettings<Tracking>;

struct NotFollowed {
  void reset() {}
  void next_sample() {}
  int16_t step(uint8_t, int16_t alpha, bool) { return alpha; }
};

template <uint8_t kStrips>
class Follower {
 public:
  // `strips`: kStrips of them, in flash on the microcontroller; both outlive this object.
  Follower(const TrackerSettings& settings, const TrackedStrip* strips, uint8_t samples_per_tick)
      : settings_(settings), strips_(strips), samples_per_tick_(samples_per_tick) {
    reset();
  }

  // Whether `strips` are what the model was made for.
  void follow(bool on) {
    is_on_ = on;
    reset();
  }

  // Nothing is found yet: the strips have been zeroed.
  void reset() {
    for (sensor::Tracker<Tracking>& tracker : tracker_) tracker.reset(settings_);
  }

  // Before the strips' readings of a sample.
  void next_sample() {
    tick_ = until_ == 0;
    until_ = tick_ ? static_cast<uint8_t>(samples_per_tick_ - 1) : static_cast<uint8_t>(until_ - 1);
  }

  int16_t step(uint8_t i, int16_t alpha, bool alive) {
    const TrackedStrip strip = {core::table(strips_[i].middle), core::table(strips_[i].half),
                                core::table(strips_[i].noise), core::table(strips_[i].max_step),
                                core::table(strips_[i].per_half)};
    if (strip.half == 0 || !is_on_) return alpha;
    const int16_t corrected = tracker_[i].corrected(strip, alpha);
    if (tick_ && alive) tracker_[i].observe(settings_, strip, alpha);
    return corrected;
  }

 private:
  const TrackerSettings& settings_;
  const TrackedStrip* strips_;
  uint8_t samples_per_tick_;
  bool is_on_ = true;
  uint8_t until_ = 0;
  bool tick_ = false;
  sensor::Tracker<Tracking> tracker_[kStrips];
};

}  // namespace glove
}  // namespace flexor
