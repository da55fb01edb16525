// Smooth static curves in floating point, held constant outside [low, high]. In fixed point the host makes
// piecewise-linear curves of them.
//
//   polynomial  y = c_0 + c_1 t + ... + c_n t^n,   t = (2 u - low - high) / (high - low)
//   cubic       y = a_i + b_i s + c_i s^2 + d_i s^3,   s = r_i (u - x_i), for x_i <= u < x_{i+1},
//               r_i = 1 / (x_{i+1} - x_i): s runs from 0 to 1, so that a .. d have the size of y
#pragma once

#include "runtime/compensator/curve.hpp"

namespace flexor {
namespace compensator {

template <class Real, int kCapacity>
struct Polynomial {
  uint8_t count;  // 1 to kCapacity coefficients
  Real low;
  Real high;
  Real coefficient[kCapacity];

  Real operator()(Real u) const {
    const Real t = (2 * core::clamp(u, low, high) - low - high) / (high - low);
    Real y = 0;
    for (uint8_t i = count; i-- > 0;) y = y * t + coefficient[i];
    return y;
  }
};

template <class Real, int kCapacity>
struct Cubic {
  uint8_t count;  // 2 to kCapacity knots
  Real x[kCapacity];
  Real r[kCapacity];  // r_i and a_i .. d_i belong to the segment right of knot i
  Real a[kCapacity];
  Real b[kCapacity];
  Real c[kCapacity];
  Real d[kCapacity];

  Real operator()(Real u) const {
    const Real inside = core::clamp(u, x[0], x[count - 1]);
    const uint8_t i = find_segment(x, count, inside);
    const Real s = r[i] * (inside - x[i]);
    return a[i] + s * (b[i] + s * (c[i] + s * d[i]));
  }
};

}  // namespace compensator
}  // namespace flexor
