// Saturation: y = min(max(u, lower), upper), lower < upper, all in one unit and fraction.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

template <class Number>
struct Saturation {
  Number lower;
  Number upper;

  FLEXOR_INLINE Number operator()(Number u) const { return core::clamp(u, lower, upper); }

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t) {
    coder.i16(lower);
    coder.i16(upper);
  }
};

}  // namespace compensator
}  // namespace flexor
