// Piecewise-linear static curve through knots (x_i, y_i), held constant outside the first and last knot.
//
//   f(u) = y_i + s_i (u - x_i)   for x_i <= u < x_{i+1},   s_i = (y_{i+1} - y_i) / (x_{i+1} - x_i)
//   f(u) = y_0 for u <= x_0,   f(u) = y_{n-1} for u >= x_{n-1}
//
// x strictly increasing, 2 <= count <= kCapacity.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

// The segment i with x[i] <= u < x[i+1], for u inside [x[0], x[count-1]].
template <class Number>
inline uint8_t find_segment(const Number* x, uint8_t count, Number u) {
  uint8_t i = 0;
  while (i + 2 < count && u >= core::table(x[i + 1])) ++i;
  return i;
}

template <class Real, int kCapacity>
struct Curve {
  uint8_t count;
  Real x[kCapacity];
  Real y[kCapacity];
  Real slope[kCapacity];  // slope[i] belongs to the segment right of knot i

  Real operator()(Real u) const {
    const Real inside = core::clamp(u, x[0], x[count - 1]);
    const uint8_t i = find_segment(x, count, inside);
    return y[i] + slope[i] * (inside - x[i]);
  }
};

// Input and knots in one fraction, Q5 or finer; their values and output in a fraction that the host chooses
// so that all of them fit int16. y[i] + round(slope[i] * (u - x[i]) / 2^slope_shift); slope_shift is
// in 1..15.
template <int kCapacity>
struct FixedCurve {
  uint8_t count;
  uint8_t slope_shift;
  int16_t x[kCapacity];
  int16_t y[kCapacity];
  int16_t slope[kCapacity];

  FLEXOR_INLINE int16_t operator()(int16_t u) const {
    const int16_t inside = core::clamp(u, x[0], x[count - 1]);
    const uint8_t i = find_segment(x, count, inside);
    // A segment may be wider than half the int16 range: the distance is taken in 32 bits.
    const int32_t product = (static_cast<int32_t>(inside) - core::table(x[i])) * core::table(slope[i]);
    return core::narrow(core::table(y[i]) + (product >> slope_shift) + ((product >> (slope_shift - 1)) & 1));
  }
};

}  // namespace compensator
}  // namespace flexor
