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

// Weight in (0, 1]: mantissa / 2^(16 + shift), so that slow poles keep sixteen significant bits.
struct FixedWeight {
  uint16_t mantissa;
  uint8_t shift;

  int32_t times(int32_t difference) const { return core::multiply_q16(difference, mantissa) >> shift; }
};

// Input int16 in any fraction; states and output int32 in Q20, every value and difference below 2048.
// w = gain * v / 2^gain_shift + offset (gain_shift < 0 shifts left); taps are tap / 2^tap_fraction.
template <int kOrder, bool kTaps>
struct FixedLti {
  int16_t gain;
  int8_t gain_shift;
  int32_t offset;
  FixedWeight input_weight[kOrder];
  FixedWeight chain_weight[kOrder * (kOrder - 1) / 2 + 1];
  int16_t tap[kOrder];
  uint8_t tap_fraction;

  struct State {
    int32_t x[kOrder];
  };

  int32_t scaled(int16_t v) const {
    const int32_t product = static_cast<int32_t>(v) * gain;
    return (gain_shift < 0 ? product * (static_cast<int32_t>(1) << -gain_shift) : product >> gain_shift) +
           offset;
  }

  void start(State& state, int16_t v) const {
    const int32_t w = scaled(v);
    for (int i = 0; i < kOrder; ++i) state.x[i] = w;
  }

  int32_t step(State& state, int16_t v) const {
    const int32_t w = scaled(v);
    for (int i = kOrder - 1; i >= 0; --i) {
      int32_t delta = input_weight[i].times(w - state.x[i]);
      for (int j = 0; j < i; ++j) {
        delta += chain_weight[chain_index(i, j)].times(state.x[j] - state.x[i]);
      }
      state.x[i] += delta;
    }
    const int32_t last = state.x[kOrder - 1];
    if (!kTaps) return last;
    int32_t y = last + tapped(tap[0], w - last);
    for (int i = 1; i < kOrder; ++i) y += tapped(tap[i], state.x[i - 1] - last);
    return y;
  }

 private:
  int32_t tapped(int16_t c, int32_t difference) const {
    if (c == 0) return 0;  // most are: saves the product on the microcontroller
    return core::multiply_q16(difference, c) * (static_cast<int32_t>(1) << (16 - tap_fraction));
  }
};

}  // namespace compensator
}  // namespace flexor
