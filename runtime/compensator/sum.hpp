// Weighted sum of signals and an offset; with one signal, a gain and an offset.
//
//   y = offset + sum_i w_i u_i
//
// Fixed point: each u_i is int16 in a fraction of its own, which its weight takes up; the sum has `shift` bits
// more than y and is rounded once. The host keeps it below 2^30.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

template <class Real, int kCapacity>
struct Sum {
  uint8_t count;
  Real weight[kCapacity];
  Real offset;

  Real operator()(const Real* u) const {
    Real y = offset;
    for (uint8_t i = 0; i < count; ++i) y += weight[i] * u[i];
    return y;
  }
};

template <int kCapacity>
struct FixedSum {
  uint8_t count;
  uint8_t shift;  // at least 1
  int16_t weight[kCapacity];
  int32_t offset;

  FLEXOR_INLINE int16_t operator()(const int16_t* u) const {
    int32_t y = offset;
    for (uint8_t i = 0; i < count; ++i) y += static_cast<int32_t>(weight[i]) * u[i];
    return core::narrow(core::round_shift(y, shift));
  }
};

// A sum as the graph has it: of signals by their numbers, the first of which comes before it. shift 0: weights are 1, or -1
// of all but the first.
template <int kCapacity>
struct SumOfSignals {
  static constexpr uint8_t kSubtracted = 0x80;  // beside the number of a signal, with shift 0

  uint8_t shift;
  int32_t offset;
  uint8_t more;  // signals behind the first
  int16_t weight[kCapacity];
  uint8_t signal[kCapacity];

  template <class Coder>
  FLEXOR_INLINE void code(Coder& coder, uint8_t) {
    coder.within(shift, 0, 30);
    coder.i32(offset);
    coder.within(more, 0, kCapacity - 1);
    if (shift > 0) coder.i16(weight[0]);
    for (uint8_t i = 1; i <= more; ++i) {
      coder.signal(signal[i], shift > 0 ? 0 : kSubtracted);
      if (shift > 0) coder.i16(weight[i]);
    }
  }
  template <class Machine>
  FLEXOR_SHARED static typename Machine::Out interpret(typename Machine::In in, uint8_t, int16_t u) {
    const uint8_t shift = in.u8();
    int32_t y = in.i32();
    uint8_t more = in.u8();
    if (shift > 0) {
      y += core::multiply_signed(in.i16(), u);
      for (; more > 0; --more) {
        const int16_t next = Machine::signal(in.u8());
        y += core::multiply_signed(in.i16(), next);
      }
      y = core::round_shift(y, shift);
    } else {
      y += u;
      for (; more > 0; --more) {
        const uint8_t term = in.u8();
        const int16_t next = Machine::signal(term & static_cast<uint8_t>(~kSubtracted));
        if ((term & kSubtracted) == 0) y += next;
        if ((term & kSubtracted) != 0) y -= next;
      }
    }
    return {in.at, core::narrow(y)};
  }
};

}  // namespace compensator
}  // namespace flexor
