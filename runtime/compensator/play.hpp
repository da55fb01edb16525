// Play operator: rate-independent hysteresis, and its creeping kind.
//
//   play    p[k] = min(u[k] + r, max(u[k] - r, p[k-1])),           p[0] = u[0]
//   creep   p[k] = p[k-1] + share * Z_r(u[k] - p[k-1]),            p[0] = u[0]
//           Z_r(e) = e - clamp(e, -r, r),   share = 1 - exp(-rate T)
//
// r >= 0 in the input's unit. Creep is p' = rate Z_r(u - p) with u held from sample to sample: exact. It
// follows what pulls it until it is r away, and then holds still; an infinite rate makes it the play.
// p never leaves the range that u has had, in any arithmetic.
// Sources: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996), section 2.3;
// K. Kuhnen, European Journal of Control 9 (2003) 407, section 3 (creep operator).
#pragma once

#include "runtime/core/fixed_point.hpp"
#include "runtime/core/weight.hpp"

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
};

template <class Real>
struct Creep {
  Real radius;
  Real share;

  struct State {
    Real p;
  };

  void start(State& state, Real u) const { state.p = u; }

  Real step(State& state, Real u) const {
    const Real pull = u - state.p;
    state.p += share * (pull - core::clamp(pull, -radius, radius));
    return state.p;
  }
};

// Input and radius int16 in one fraction; the state has 14 bits more, so that a slow creep is not lost in rounding
// and the difference of any two values fits. The output is the state rounded.
struct FixedCreep {
  static constexpr int kUp = 14;

  int32_t radius;  // in the state's fraction
  core::Weight share;

  struct State {
    int32_t p;
  };

  FLEXOR_INLINE static int32_t wide(int16_t u) { return core::widen<16 - kUp>(u); }
  FLEXOR_INLINE void start(State& state, int16_t u) const { state.p = wide(u); }
  FLEXOR_INLINE int16_t step(State& state, int16_t u) const {
    const int32_t pull = wide(u) - state.p;
    state.p += share.times(pull - core::clamp(pull, -radius, radius));
    return static_cast<int16_t>(core::round_shift(state.p, kUp));
  }
};

}  // namespace compensator
}  // namespace flexor
