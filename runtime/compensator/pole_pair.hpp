// Linear second order with a complex pair of poles and two zeros, unit DC gain whatever the rounding.
//
//   x' = omega v,   v' = omega (u - x - 2 zeta v),   0 < zeta < 1
//   y  = x + c_0 (u - x) + c_1 v
//
// so H(s) = (omega^2 + c_1 omega s + c_0 (s^2 + 2 zeta omega s)) / (s^2 + 2 zeta omega s + omega^2).
// Exact zero-order hold on the distance from rest, e = (x - u, v): e[k] = exp(omega T [0 1; -1 -2 zeta]) e,
// where e's first element has lost u[k] - u[k-1] before. A motionless input brings e to zero, and y to u.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

template <class Real>
struct PolePair {
  Real transition[4];  // row by row
  Real tap[2];

  struct State {
    Real u;
    Real e[2];
  };

  void start(State& state, Real u) const {
    state.u = u;
    state.e[0] = state.e[1] = 0;
  }

  Real step(State& state, Real u) const {
    const Real e0 = state.e[0] - (u - state.u);
    const Real e1 = state.e[1];
    state.u = u;
    state.e[0] = transition[0] * e0 + transition[1] * e1;
    state.e[1] = transition[2] * e0 + transition[3] * e1;
    return u + (1 - tap[0]) * state.e[0] + tap[1] * state.e[1];
  }
};

// Input and output int16; e has `up` bits more. Of a pair that is slow against the sample period the transition
// hardly differs from the identity: its difference from it has a fraction of its own.
struct FixedPolePair {
  int16_t change[4];  // transition - identity
  uint8_t change_fraction;
  int16_t tap[2];  // 1 - c_0, c_1
  uint8_t tap_fraction;
  uint8_t up;
  uint8_t down;  // the output has so many bits less than e; at least 1

  struct State {
    int16_t u;
    int32_t e[2];
  };

  FLEXOR_INLINE void start(State& state, int16_t u) const {
    state.u = u;
    state.e[0] = state.e[1] = 0;
  }

  FLEXOR_INLINE int16_t step(State& state, int16_t u) const {
    const int32_t e0 = state.e[0] - (static_cast<int32_t>(u) - state.u) * (static_cast<int32_t>(1) << up);
    const int32_t e1 = state.e[1];
    state.u = u;
    state.e[0] = e0 + times(e0, change[0], change_fraction) + times(e1, change[1], change_fraction);
    state.e[1] = e1 + times(e0, change[2], change_fraction) + times(e1, change[3], change_fraction);
    const int32_t y = static_cast<int32_t>(u) * (static_cast<int32_t>(1) << up) +
                      times(state.e[0], tap[0], tap_fraction) + times(state.e[1], tap[1], tap_fraction);
    return core::narrow(core::round_shift(y, down));
  }

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t) {
    coder.words(change, 4);
    coder.within(change_fraction, 0, kMostFraction);
    coder.words(tap, 2);
    coder.within(tap_fraction, 0, kMostFraction);
    coder.within(up, 0, 16);
    coder.within(down, 1, 30);
  }

 private:
  static constexpr int8_t kMostFraction = 47;  // of a product that is shifted by 31 at most

  FLEXOR_PRODUCT_INLINE static int32_t times(int32_t a, int16_t m, uint8_t fraction) {
    const int32_t product = core::multiply_q16(a, m);
    return fraction < 16 ? product * (static_cast<int32_t>(1) << (16 - fraction))
                         : product >> (fraction - 16);
  }
};

}  // namespace compensator
}  // namespace flexor
