// First-order lag, exact zero-order hold: y[k] = y[k-1] + share (u[k] - y[k-1]),   share = 1 - exp(-rate T).
//
// The output stands after the update. A motionless input brings y to it, in any arithmetic.
#pragma once

#include "runtime/core/fixed_point.hpp"
#include "runtime/core/weight.hpp"

namespace flexor {
namespace compensator {

template <class Real>
struct Lag {
  Real share;

  struct State {
    Real y;
  };

  void start(State& state, Real u) const { state.y = u; }
  Real step(State& state, Real u) const { return state.y += share * (u - state.y); }
};

// Input and output int16 in one fraction; the state has 15 bits more, with which the difference of any two int16
// still fits.
struct FixedLag {
  core::Weight share;

  struct State {
    int32_t y;
  };

  FLEXOR_INLINE static int32_t wide(int16_t u) { return core::widen<1>(u); }
  FLEXOR_INLINE void start(State& state, int16_t u) const { state.y = wide(u); }
  FLEXOR_INLINE int16_t step(State& state, int16_t u) const {
    state.y += share.times_here(wide(u) - state.y);
    return static_cast<int16_t>(core::upper_half((state.y + 0x4000) * 2));
  }

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t) {
    coder.weight(share);
  }
};

}  // namespace compensator
}  // namespace flexor
