// A weight in (0, 1] with sixteen significant bits, whatever its size.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace core {

FLEXOR_PRODUCT_INLINE int32_t multiply_weight(int32_t difference, uint16_t mantissa, uint8_t shift) {
  return multiply_q16(difference, mantissa) >> shift;
}

// mantissa / 2^(16 + shift).
struct Weight {
  uint16_t mantissa;
  uint8_t shift;

  // floor of the product, for every difference.
  FLEXOR_INLINE int32_t times(int32_t difference) const {
    return multiply_weight(difference, mantissa, shift);
  }
  // The same, never called: where it is the only product.
  FLEXOR_INLINE int32_t times_here(int32_t difference) const {
    return multiply_q16_here(difference, mantissa) >> shift;
  }
};

}  // namespace core
}  // namespace flexor
