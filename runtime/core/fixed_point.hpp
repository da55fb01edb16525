// Integer products and conversions of the fixed-point path: equal to the bit on a PC and on an AVR.
//
// A value `v` in "Qn" is the integer round(v * 2^n). Right shifts of negative integers are arithmetic on
// every compiler that Flexor supports (gcc, clang); a static_assert below holds them to it.
#pragma once

#include <stdint.h>

namespace flexor {
namespace core {

static_assert((-3 >> 1) == -2, "the fixed-point path needs arithmetic right shifts");

constexpr int kInputFraction = 5;   // ADC counts or degrees, int16: range -1024 .. 1023.97
constexpr int kOutputFraction = 4;  // degrees, int16: range -2048 .. 2047.94
constexpr int kStateFraction = 20;  // LTI states, int32: states and their differences below 2048

// Limits `value` to [lower, upper]; lower <= upper. A NaN comes back as NaN.
template <class T>
constexpr T clamp(T value, T lower, T upper) {
  const T raised = value < lower ? lower : value;  // two steps: one maximum, one minimum, no branch
  return upper < raised ? upper : raised;
}

// floor(a * m / 2^16) without a 64-bit product: two 16x16 -> 32 multiplications.
// Domain: every a, every m; the result always fits.
inline int32_t multiply_q16(int32_t a, uint16_t m) {
  const int16_t high = static_cast<int16_t>(a >> 16);
  const uint16_t low = static_cast<uint16_t>(a);
  const int32_t low_product = static_cast<int32_t>((static_cast<uint32_t>(low) * m) >> 16);
  return static_cast<int32_t>(high) * static_cast<int32_t>(m) + low_product;
}

// The same with a signed factor: floor(a * m / 2^16) for m >= 0, its mirror image for m < 0.
inline int32_t multiply_q16(int32_t a, int16_t m) {
  return m >= 0 ? multiply_q16(a, static_cast<uint16_t>(m))
                : -multiply_q16(a, static_cast<uint16_t>(-static_cast<int32_t>(m)));
}

// value / 2^shift rounded to nearest, halves upwards; shift >= 1 and |value| < 2^30.
inline int32_t round_shift(int32_t value, uint8_t shift) {
  return (value + (static_cast<int32_t>(1) << (shift - 1))) >> shift;
}

// Saturates to int16.
inline int16_t narrow(int32_t value) {
  return static_cast<int16_t>(clamp(value, static_cast<int32_t>(INT16_MIN), static_cast<int32_t>(INT16_MAX)));
}

// a + b and a - b that stay inside int16; plain for floating point.
inline int16_t add(int16_t a, int16_t b) { return narrow(static_cast<int32_t>(a) + b); }
inline int16_t subtract(int16_t a, int16_t b) { return narrow(static_cast<int32_t>(a) - b); }
template <class Real>
constexpr Real add(Real a, Real b) {
  return a + b;
}
template <class Real>
constexpr Real subtract(Real a, Real b) {
  return a - b;
}

}  // namespace core
}  // namespace flexor
