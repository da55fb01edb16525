// Play operator: rate-independent hysteresis.
//
//   p[k] = min(u[k] + r, max(u[k] - r, p[k-1])),           p[0] = u[0]
//
// r >= 0 in the input's unit. p never leaves the range that u has had, in any arithmetic.
// Source: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996), section 2.3.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

// Where a play stands after the input u. Saturating u - r and u + r loses nothing: it stays between values that u
// has had.
template <class Number>
FLEXOR_INLINE Number moved(Number p, Number u, Number radius) {
  return core::clamp(p, core::subtract(u, radius), core::add(u, radius));
}

// Number is float, double, or int16_t with the radius in the input's fraction.
template <class Number>
struct Play {
  Number radius;

  struct State {
    Number p;
  };

  FLEXOR_INLINE void start(State& state, Number u) const { state.p = u; }

  FLEXOR_INLINE Number step(State& state, Number u) const { return state.p = moved(state.p, u, radius); }

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t) {
    coder.i16(radius);
  }
};

}  // namespace compensator
}  // namespace flexor
