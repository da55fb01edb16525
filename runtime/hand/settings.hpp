// What a hand's image is given of its hand: a block of data (core/flash_map.hpp). Whoever writes a board's settings writes this
// struct as it lies in memory, low bytes first.
#pragma once

#include "runtime/hand/finger.hpp"

namespace flexor {
namespace hand {

constexpr uint16_t kSettingsKind = 0x0101;  // version, link::BoardKind::hand
constexpr uint8_t kFingers = 5;

// Of one finger; the rest is the same for all.
struct Reach {
  int16_t lower;  // of the command, Q4 degrees
  int16_t upper;
  int16_t rest;
  uint16_t low;  // of the potentiometer, counts
  uint16_t high;
};

struct Settings {
  static constexpr uint16_t kKind = kSettingsKind;
  uint16_t kind;
  uint16_t uart_divisor;
  int32_t max_step;  // LoopSettings
  int32_t integral_limit;
  int32_t careful_step;
  uint32_t scale;  // Potentiometer
  int16_t proportional;
  int16_t integral;
  int16_t duty_limit;
  int16_t feed_forward;
  int16_t offset;  // Potentiometer
  MotorSettings motor;
  Reach reach[kFingers];

  FingerSettings finger(uint8_t i) const {
    const Reach& r = reach[i];
    return {{r.lower, r.upper, max_step, proportional, integral, integral_limit, duty_limit, feed_forward},
            {scale, offset, r.low, r.high},
            careful_step,
            motor};
  }
};
static_assert(sizeof(Settings) == 96, "as it lies in flash");

}  // namespace hand
}  // namespace flexor
