// Dead zone with separate edges.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

// phi(u) = u - lower  for u < lower
//          0          for lower <= u <= upper
//          u - upper  for u > upper,      that is u - clamp(u, lower, upper).
// Equal edges of zero make it the identity. Edges are in the input's unit; lower <= upper.
// Source: Sensors 2019, 19(18), 3896, section 3.4, where lower = -eps_l and upper = +eps_u.
// Number is float, double, or int16_t in Q5 (the host checks that u - edge fits).
template <class Number>
struct DeadZone {
  Number lower;
  Number upper;

  FLEXOR_INLINE Number operator()(Number u) const {
    return static_cast<Number>(u - core::clamp(u, lower, upper));
  }

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t) {
    coder.i16(lower);
    coder.i16(upper);
  }
};

}  // namespace compensator
}  // namespace flexor
