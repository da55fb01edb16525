// What goes out while a sensor is dead: the last angle for a while, then the rest angle, approached at a
// bounded speed. When the sensor lives again the output comes back at the same speed, without a jump. One
// call a sample.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace sensor {

struct GuardSettings {
  int16_t rest;      // Q4 degrees
  int16_t max_step;  // Q4 degrees in a sample, > 0
  uint16_t hold_samples;
};

class Guard {
 public:
  void reset(const GuardSettings& c) {
    *this = Guard();
    output_ = c.rest;
  }

  // `angle` is the compensator's, Q4 degrees; looked at only while `alive`.
  int16_t step(const GuardSettings& c, bool alive, int16_t angle) {
    if (!alive) {
      returning_ = true;
      if (dead_ < c.hold_samples) {
        ++dead_;
        return output_;
      }
      return approach(c, c.rest);
    }
    dead_ = 0;
    if (!returning_) return output_ = angle;
    returning_ = approach(c, angle) != angle;
    return output_;
  }

 private:
  FLEXOR_SHARED int16_t approach(const GuardSettings& c, int16_t goal) {
    const int16_t way = core::subtract(goal, output_);
    const int16_t back = static_cast<int16_t>(-c.max_step);
    return output_ = static_cast<int16_t>(output_ + core::clamp(way, back, c.max_step));
  }

  int16_t output_ = 0;
  uint16_t dead_ = 0;
  bool returning_ = true;  // at power-on the first angle is approached, too
};

}  // namespace sensor
}  // namespace flexor
