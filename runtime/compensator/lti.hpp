// Linear time-invariant block of order 0 to 3 with real poles: gain, offset, and a chain of first-order lags
// whose unit DC gain no rounding can disturb.
//
// Continuous time, v the input, rates a_i > 0 (poles -a_i):
//   w    = gain * v + offset
//   x_1' = a_1 (w - x_1),    x_i' = a_i (x_{i-1} - x_i)
//   y    = x_n + sum_{i<n} c_i (x_i - x_n),   with x_0 = w
// so H(s) = gain * (c_0 + c_1 H_1 + ... + (1 - sum c) H_n),  H_i = prod_{j<=i} a_j / (s + a_j).
// c = 0 is the plain chain; the c place the zeros. Every rational H with real poles, no more zeros than poles
// and a DC gain other than zero can be written so, equal poles included.
//
// Exact zero-order hold (host/model computes it from the matrix exponential Ad = exp(A T)):
//   x_i[k+1] = x_i + sum_{j<i} Ad_ij (x_j - x_i) + b_i (w - x_i),   b_i = 1 - sum_j Ad_ij
// All weights are in [0, 1] and sum to at most one: each state is a weighted mean of old states and input,
// so it never leaves the range of its inputs, in any arithmetic. The output is taken after the update:
// read before it, a strictly proper hold would add a hidden sample of delay.
#pragma once

#include "runtime/core/fixed_point.hpp"
#include "runtime/core/weight.hpp"

namespace flexor {
namespace compensator {

constexpr int kMaxOrder = 3;

// Place of Ad_ij (j < i) in the packed strictly lower triangle.
constexpr int chain_index(int i, int j) { return i * (i - 1) / 2 + j; }

// kTaps false: all c are zero, a plain chain of lags.
template <class Real, int kOrder, bool kTaps>
struct Lti {
  Real gain;
  Real offset;
  Real input_weight[kOrder];                         // b_i
  Real chain_weight[kOrder * (kOrder - 1) / 2 + 1];  // Ad_ij at chain_index(i, j)
  Real tap[kOrder];                                  // c_0 .. c_{n-1}

  struct State {
    Real x[kOrder];
  };

  // Steady state of the first sample: no start-up transient.
  void start(State& state, Real v) const {
    const Real w = gain * v + offset;
    for (int i = 0; i < kOrder; ++i) state.x[i] = w;
  }

  Real step(State& state, Real v) const {
    const Real w = gain * v + offset;
    // From the last state to the first: state i needs the old values of the states before it only.
    for (int i = kOrder - 1; i >= 0; --i) {
      Real delta = input_weight[i] * (w - state.x[i]);
      for (int j = 0; j < i; ++j) delta += chain_weight[chain_index(i, j)] * (state.x[j] - state.x[i]);
      state.x[i] += delta;
    }
    const Real last = state.x[kOrder - 1];
    if (!kTaps) return last;
    Real y = last + tap[0] * (w - last);
    for (int i = 1; i < kOrder; ++i) y += tap[i] * (state.x[i - 1] - last);
    return y;
  }
};

// A plain chain (all c zero, no offset) whose poles are quick against the sample period, in direct form:
//   y[k] = b_0 v[k] + a_1 y[k-1] + t_1[k-1]                        y rounded to Q4
//   t_1[k] = b_1 v[k] - a_2 y[k-1] + t_2[k-1],   t_2[k] = b_2 v[k] + a_3 y[k-1]
//   prod_i (1 - p_i / z) = 1 - a_1 / z + a_2 / z^2 - a_3 / z^3,  p_i = exp(-a_i T)
// Half the products of the difference form, and short ones. y's rounding, half of 2^-4 degree, grows by 1 /
// prod (1 - p_i). The host bounds that and what rounding the coefficients costs; where the sum could pass one
// step of y, 1/16 degree, or take y below zero, it leaves the difference form in place. v is Q5 and never
// negative, nor is y; b is Q15, a is Q16, t is Q20.
template <int kOrder>
struct DirectForm {
  static_assert(kOrder >= 1 && kOrder <= kMaxOrder, "written out for order 1 to 3");
  uint16_t b[kOrder];
  uint16_t a[kOrder];

  struct State {
    uint16_t y;
    int32_t t[kOrder > 1 ? kOrder - 1 : 1];
  };

  // Steady state; small rather than quick, since it happens once.
  FLEXOR_INLINE void start(State& state, uint16_t v, uint16_t y) const {
    const auto product = [](uint16_t m, uint16_t x) {
      return static_cast<int32_t>(static_cast<uint32_t>(m) * x);
    };
    state.y = y;
    int32_t t = 0;
    if (kOrder > 2) state.t[kSecond] = t = product(b[kB2], v) + product(a[kB2], y);
    if (kOrder > 1) state.t[0] = t + product(b[kB1], v) - product(a[kB1], y);
  }

  FLEXOR_INLINE uint16_t step(State& state, uint16_t v) const {
    const uint16_t old = state.y;
    int32_t y = core::multiply_add(core::multiply(v, b[0]), old, a[0]);
    if (kOrder > 1) y += state.t[0];
    if (kOrder > 1) state.t[0] = first(state, v, old);
    if (kOrder > 2) state.t[kSecond] = second(v, old);
    return state.y = core::upper_half(y + 0x8000);
  }

  // In a graph as data: of this order, at most the form's own.
  template <class Machine>
  FLEXOR_SHARED static typename Machine::Out interpret(typename Machine::In in, uint8_t order, State& state,
                                                       uint16_t v) {
    const uint16_t old = state.y;
    int32_t y = core::multiply(v, in.u16());
    y = core::multiply_add(y, old, in.u16());
    if (order > 1) {
      y += state.t[0];
      int32_t t = order > 2 ? state.t[kSecond] : 0;
      t = core::multiply_add(t, v, in.u16());
      state.t[0] = core::multiply_subtract(t, old, in.u16());
    }
    if (order > 2) {
      const int32_t t = core::multiply(v, in.u16());
      state.t[kSecond] = core::multiply_add(t, old, in.u16());
    }
    state.y = core::upper_half(y + 0x8000);
    return {in.at, static_cast<int16_t>(state.y)};
  }

 private:
  // Places that a lower order does not have, and never reads.
  static constexpr int kSecond = kOrder > 2 ? 1 : 0;
  static constexpr int kB1 = kOrder > 1 ? 1 : 0;
  static constexpr int kB2 = kOrder > 2 ? 2 : 0;

  FLEXOR_INLINE int32_t first(const State& state, uint16_t v, uint16_t y) const {
    const int32_t t =
        kOrder > 2 ? core::multiply_add(state.t[kSecond], v, b[kB1]) : core::multiply(v, b[kB1]);
    return core::multiply_subtract(t, y, a[kB1]);
  }
  FLEXOR_INLINE int32_t second(uint16_t v, uint16_t y) const {
    return core::multiply_add(core::multiply(v, b[kB2]), y, a[kB2]);
  }
};

// v * gain / 2^shift, by a shift to the left where it is negative.
FLEXOR_PRODUCT_INLINE int32_t scaled_by(int16_t v, int16_t gain, int8_t shift) {
  const int32_t product = static_cast<int32_t>(v) * gain;
  return shift < 0 ? product * (static_cast<int32_t>(1) << -shift) : product >> shift;
}

// Input int16 in any fraction; states int32 in Q20, every value and difference below 2048; the output is
// int16, `output_shift` bits less, and saturates. w = gain * v / 2^gain_shift + offset (gain_shift < 0 shifts
// left); taps are tap / 2^tap_fraction.
// Written out instead of in loops: on the microcontroller every coefficient is then a constant of its
// instruction.
template <int kOrder, bool kTaps>
struct FixedLti {
  int16_t gain;
  int8_t gain_shift;
  int32_t offset;
  core::Weight input_weight[kOrder];
  core::Weight chain_weight[kOrder * (kOrder - 1) / 2 + 1];
  int16_t tap[kOrder];
  uint8_t tap_fraction;
  uint8_t output_shift;
  bool is_direct;  // `direct` below takes the place of the rest
  DirectForm<kOrder> direct;

  union State {
    int32_t x[kOrder];
    typename DirectForm<kOrder>::State direct;
  };

  // c 2^-fraction of it.
  FLEXOR_PRODUCT_INLINE static int32_t tapped(int16_t c, uint8_t fraction, int32_t difference) {
    if (c == 0) return 0;  // most are: saves the product on the microcontroller
    return core::multiply_q16(difference, c) * (static_cast<int32_t>(1) << (16 - fraction));
  }

  FLEXOR_INLINE int32_t scaled(int16_t v) const { return scaled_by(v, gain, gain_shift) + offset; }

  FLEXOR_INLINE void start(State& state, int16_t v) const {
    const int32_t w = scaled(v);
    if (is_direct) {
      direct.start(state.direct, static_cast<uint16_t>(v), static_cast<uint16_t>(core::round_shift(w, 16)));
      return;
    }
    for (int i = 0; i < kOrder; ++i) state.x[i] = w;
  }

  FLEXOR_INLINE int16_t step(State& state, int16_t v) const {
    if (is_direct) return static_cast<int16_t>(direct.step(state.direct, static_cast<uint16_t>(v)));
    return core::narrow(core::round_shift(wide_step(state, v), output_shift));
  }

  // n: order, and how. States at the front that a shorter chain does not use are left out.
  static constexpr uint8_t kOrderBits = 3;
  static constexpr uint8_t kHasTaps = 4;
  static constexpr uint8_t kIsDirect = 8;

  uint8_t number() const {
    uint8_t order = kOrder;
    while (order > 1 && input_weight[kOrder - order].mantissa == 0) --order;
    if (is_direct) return static_cast<uint8_t>(order | kIsDirect);
    bool has_taps = input_weight[kOrder - 1].mantissa == 0;
    for (const int16_t c : tap) has_taps = has_taps || c != 0;
    return static_cast<uint8_t>(has_taps ? order | kHasTaps : order);
  }
  // A direct form has a y, which is as long as two bytes or as four, before its t.
  FLEXOR_INLINE static uint8_t state_bytes(uint8_t n) {
    const uint8_t chain = static_cast<uint8_t>(4 * (n & kOrderBits));
    constexpr uint8_t kLess = static_cast<uint8_t>(4 * kOrder - sizeof(typename DirectForm<kOrder>::State));
    return (n & kIsDirect) != 0 ? static_cast<uint8_t>(chain - kLess) : chain;
  }

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t n) {
    const uint8_t order = n & kOrderBits;
    coder.require(order >= 1 && order <= kOrder);
    coder.i16(gain);
    coder.within(gain_shift, -16, 15);
    if ((n & kIsDirect) != 0) {
      for (uint8_t i = 0; i < order; ++i) {
        coder.u16(direct.b[i]);
        coder.u16(direct.a[i]);
      }
      return;
    }
    coder.i32(offset);
    const uint8_t left_out = static_cast<uint8_t>(kOrder - order);
    for (uint8_t i = kOrder; i-- > left_out;) {
      coder.weight(input_weight[i]);
      for (uint8_t j = left_out; j < i; ++j) coder.weight(chain_weight[chain_index(i, j)]);
    }
    if ((n & kHasTaps) != 0) {
      coder.within(tap_fraction, 0, 16);
      coder.i16(tap[0]);
      for (uint8_t i = 1; i < order; ++i) coder.i16(tap[left_out + i]);
    }
    coder.within(output_shift, 1, 30);
  }
  template <class Machine>
  FLEXOR_SHARED static typename Machine::Out interpret(typename Machine::In in, uint8_t n, int16_t u) {
    return (n & kIsDirect) != 0 ? interpret_direct<Machine>(in, n, u) : interpret_chain<Machine>(in, n, u);
  }

 private:
  template <class Machine>
  FLEXOR_SHARED static typename Machine::Out interpret_chain(typename Machine::In in, uint8_t n, int16_t u) {
    const int16_t gain = in.i16();
    int32_t w = scaled_by(u, gain, in.i8());
    w += in.i32();
    const uint8_t order = n & kOrderBits;
    int32_t* const x = Machine::template state<int32_t>(state_bytes(n));
    if (Machine::first()) {
      for (uint8_t i = 0; i < order; ++i) x[i] = w;
    }
    // From the last state to the first: a state needs the old values of those before it.
    for (uint8_t i = order; i-- > 0;) {
      const int32_t old = x[i];
      int32_t now = old + in.weight().times(w - old);
      for (uint8_t j = 0; j < i; ++j) now += in.weight().times(x[j] - old);
      x[i] = now;
    }
    const int32_t last = x[order - 1];
    int32_t y = last;
    if ((n & kHasTaps) != 0) {
      const uint8_t fraction = in.u8();
      int32_t from = w;
      for (uint8_t i = 0; i < order; from = x[i++]) y += tapped(in.i16(), fraction, from - last);
    }
    const uint8_t shift = in.u8();  // before `in` is passed on: arguments have no order
    return {in.at, core::narrow(core::round_shift(y, shift))};
  }

  template <class Machine>
  FLEXOR_SHARED static typename Machine::Out interpret_direct(typename Machine::In in, uint8_t n, int16_t u) {
    using Direct = DirectForm<kOrder>;
    if (Machine::first()) return start_direct<Machine>(in, n, u);
    typename Direct::State& state = *Machine::template state<typename Direct::State>(state_bytes(n));
    return Direct::template interpret<Machine>({in.at + 3}, n & kOrderBits, state, static_cast<uint16_t>(u));
  }
  // The first y; the rest is steady after as many steps as the order has.
  template <class Machine>
  FLEXOR_SHARED static typename Machine::Out start_direct(typename Machine::In in, uint8_t n, int16_t u) {
    using Direct = DirectForm<kOrder>;
    typename Direct::State& state = *Machine::template state<typename Direct::State>(state_bytes(n));
    const int16_t gain = in.i16();
    const int32_t w = scaled_by(u, gain, in.i8());
    uint8_t steps = n & kOrderBits;
    for (uint8_t i = 0; i + 1 < steps; ++i) state.t[i] = 0;
    for (;; --steps) {
      state.y = static_cast<uint16_t>(core::round_shift(w, 16));
      const typename Machine::Out out =
          Direct::template interpret<Machine>(in, n & kOrderBits, state, static_cast<uint16_t>(u));
      if (steps == 1) return out;
    }
  }

  FLEXOR_INLINE int32_t wide_step(State& state, int16_t v) const {
    const int32_t w = scaled(v);
    // From the last state to the first: a state needs the old values of those before it.
    if (kOrder > 2) {
      const int32_t x = state.x[kX2];
      state.x[kX2] = x + input_weight[kX2].times(w - x) + chain_weight[kA20].times(state.x[0] - x) +
                     chain_weight[kA21].times(state.x[kX1] - x);
    }
    if (kOrder > 1) {
      const int32_t x = state.x[kX1];
      state.x[kX1] = x + input_weight[kX1].times(w - x) + chain_weight[kA10].times(state.x[0] - x);
    }
    state.x[0] += input_weight[0].times(w - state.x[0]);
    const int32_t last = state.x[kOrder - 1];
    if (!kTaps) return last;
    int32_t y = last + tapped(tap[0], tap_fraction, w - last);
    if (kOrder > 1) y += tapped(tap[kX1], tap_fraction, state.x[0] - last);
    if (kOrder > 2) y += tapped(tap[kX2], tap_fraction, state.x[kX1] - last);
    return y;
  }

  // Places that a lower order does not have, and never reads.
  static constexpr int kX1 = kOrder > 1 ? 1 : 0;
  static constexpr int kX2 = kOrder > 2 ? 2 : 0;
  static constexpr int kA10 = kOrder > 1 ? chain_index(1, 0) : 0;
  static constexpr int kA20 = kOrder > 2 ? chain_index(2, 0) : 0;
  static constexpr int kA21 = kOrder > 2 ? chain_index(2, 1) : 0;
};

}  // namespace compensator
}  // namespace flexor
