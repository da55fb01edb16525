// A small bank of play operators: rate-independent hysteresis (Prandtl-Ishlinskii).
//
//   z[k] = u[k] + sum_j w_j (p_j[k] - u[k]),   p_j the play of radius r_j (play.hpp)
//
// r_j >= 0 is in the input's unit, w_j has none. Written with differences, so that a motionless input
// passes unchanged whatever the rounding of the weights, and |z - u| <= sum_j |w_j| r_j always.
// Source: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996), section 2.3.
#pragma once

#include "runtime/compensator/play.hpp"

namespace flexor {
namespace compensator {

// kCapacity >= 1 plays at most; `count` of them are used. The plays are the same for every number.
template <class Number, int kCapacity>
struct Plays {
  uint8_t count;
  Number radius[kCapacity];

  struct State {
    Number p[kCapacity];
  };

  FLEXOR_INLINE void start(State& state, Number u) const {
    for (uint8_t j = 0; j < count; ++j) state.p[j] = u;
  }

  // Moves play j and returns p_j - u.
  FLEXOR_INLINE Number step(State& state, uint8_t j, Number u) const {
    state.p[j] = moved(state.p[j], u, core::table(radius[j]));
    return core::subtract(state.p[j], u);
  }
};

template <class Real, int kCapacity>
struct Hysteresis {
  Plays<Real, kCapacity> plays;
  Real weight[kCapacity];

  using State = typename Plays<Real, kCapacity>::State;

  void start(State& state, Real u) const { plays.start(state, u); }

  Real step(State& state, Real u) const {
    Real z = u;
    for (uint8_t j = 0; j < plays.count; ++j) z += weight[j] * plays.step(state, j, u);
    return z;
  }
};

// Input, output and radii in the same fraction; weights Q12 (|w| < 8).
constexpr int kHysteresisWeightFraction = 12;

template <int kCapacity>
struct FixedHysteresis {
  Plays<int16_t, kCapacity> plays;
  int16_t weight[kCapacity];

  using State = typename Plays<int16_t, kCapacity>::State;

  FLEXOR_INLINE void start(State& state, int16_t u) const { plays.start(state, u); }

  FLEXOR_INLINE int16_t step(State& state, int16_t u) const {
    int32_t sum = 0;
    for (uint8_t j = 0; j < plays.count; ++j) sum += term(core::table(weight[j]), plays.step(state, j, u));
    return total(u, sum);
  }

  // n: how many plays.
  FLEXOR_INLINE uint8_t number() const { return plays.count; }
  FLEXOR_INLINE static uint8_t state_bytes(uint8_t n) { return static_cast<uint8_t>(2 * n); }
  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t n) {
    if (!coder.require(n <= kCapacity)) return;
    for (uint8_t j = 0; j < n; ++j) {
      coder.i16(plays.radius[j]);
      coder.i16(weight[j]);
    }
  }
  template <class Machine>
  FLEXOR_INLINE static typename Machine::Out interpret(typename Machine::In in, uint8_t n, int16_t u) {
    int16_t* p = Machine::template state<int16_t>(state_bytes(n));
    int32_t sum = 0;
    for (; n > 0; --n, ++p) {
      const int16_t moved_to = moved(*p, u, in.i16());
      *p = Machine::first() ? u : moved_to;
      sum += term(in.i16(), core::subtract(*p, u));
    }
    return {in.at, total(u, sum)};
  }

  FLEXOR_INLINE static int32_t term(int16_t weight, int16_t difference) {
    return static_cast<int32_t>(weight) * difference;
  }
  FLEXOR_INLINE static int16_t total(int16_t u, int32_t sum) {
    return core::narrow(u + core::round_shift(sum, kHysteresisWeightFraction));
  }
};

}  // namespace compensator
}  // namespace flexor
