// Delay by whole samples: y[k] = u[k - count]; before the start u was what the first sample says.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace compensator {

template <class Number, int kCapacity>
struct Delay {
  uint8_t count;  // 1 to kCapacity

  struct State {
    Number past[kCapacity];
    uint8_t oldest;
  };

  void start(State& state, Number u) const {
    for (uint8_t i = 0; i < count; ++i) state.past[i] = u;
    state.oldest = 0;
  }

  Number step(State& state, Number u) const {
    const Number y = state.past[state.oldest];
    state.past[state.oldest] = u;
    state.oldest = static_cast<uint8_t>(state.oldest + 1 == count ? 0 : state.oldest + 1);
    return y;
  }
};

}  // namespace compensator
}  // namespace flexor
