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

}  // namespace compensator
}  // namespace flexor
