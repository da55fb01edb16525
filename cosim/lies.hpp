// What a potentiometer says that does not tell the truth.
#pragma once

#include <algorithm>

#include "host/twin/random.hpp"

namespace flexor::cosim {

enum class Lie { none, frozen, slipped_up, slipped_down, reversed, neighbour, noisy };
inline constexpr int kLies = 7;

inline constexpr int kSlip_counts = 164;  // 40 degrees

// Counts that are read: `held` were true when it began to lie, `neighbours` are true of the finger before.
inline int told(Lie lie, int counts, int held, int neighbours, twin::Random& random) {
  const int lies[kLies] = {counts,
                           held,
                           counts + kSlip_counts,
                           counts - kSlip_counts,
                           2 * held - counts,
                           neighbours,
                           lie == Lie::noisy ? counts + static_cast<int>(40 * random.normal()) : counts};
  return std::clamp(lies[static_cast<int>(lie)], 0, 1023);
}

}  // namespace flexor::cosim
