// ADC counts to alpha, the reading in degree-like units that every compensator gets.
//
//   alpha = y_i + (y_{i+1} - y_i) (n - 16 i) / 16,   i = n div 16,   n in 0 .. 1023
// Knots every 16 counts, so that no search is needed and the divider's curve is followed within less than a
// count. The host computes them: from equations 1 to 3 of Sensors 2019, 19(18), 3896, from two measured
// points, or from a curve.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace sensor {

constexpr uint16_t kAdcTop = 1023;
constexpr uint8_t kKnots = 65;

struct Calibration {
  int16_t alpha[kKnots];  // Q5 degrees at counts 0, 16, .. 1024

  // counts above the top are taken for the top.
  int16_t operator()(uint16_t counts) const {
    const uint16_t n = counts > kAdcTop ? kAdcTop : counts;
    const uint8_t i = static_cast<uint8_t>(n >> 4);
    const int16_t left = core::table(alpha[i]);
    const int32_t rise = static_cast<int32_t>(core::table(alpha[i + 1])) - left;
    return static_cast<int16_t>(left + ((rise * static_cast<int32_t>(n & 15) + 8) >> 4));
  }
};

}  // namespace sensor
}  // namespace flexor
