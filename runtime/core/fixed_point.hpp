// Integer products and conversions of the fixed-point path: equal to the bit on a PC and on an AVR.
//
// A value `v` in "Qn" is the integer round(v * 2^n). Right shifts of negative integers are arithmetic on
// every compiler that Flexor supports (gcc, clang); a static_assert below holds them to it.
#pragma once

#include <stdint.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#endif

// Coefficients of firmware are constants: only inside its caller can a step be folded with them.
#define FLEXOR_INLINE __attribute__((always_inline)) inline
// Too long to stand at every call on a microcontroller.
#ifdef __AVR__
#define FLEXOR_SHARED __attribute__((noinline)) inline
#else
#define FLEXOR_SHARED inline
#endif

// The long products of states. Where blocks are interpreted, all that run share them.
#ifdef FLEXOR_MODEL_AS_DATA
#define FLEXOR_PRODUCT_INLINE FLEXOR_SHARED
#else
#define FLEXOR_PRODUCT_INLINE FLEXOR_INLINE
#endif

namespace flexor {
namespace core {

static_assert((-3 >> 1) == -2, "the fixed-point path needs arithmetic right shifts");

constexpr int kInputFraction = 5;   // ADC counts or degrees, int16: range -1024 .. 1023.97
constexpr int kOutputFraction = 4;  // degrees, int16: range -2048 .. 2047.94
constexpr int kStateFraction = 20;  // LTI states, int32: states and their differences below 2048

// A number of a table that is searched or looped over. On the microcontroller such tables, and the
// coefficients that they are part of, lie in flash (PROGMEM); all other coefficients are constants of their
// instructions.
#ifdef __AVR__
FLEXOR_INLINE int16_t table(const int16_t& x) { return static_cast<int16_t>(pgm_read_word(&x)); }
FLEXOR_INLINE uint16_t table(const uint16_t& x) { return pgm_read_word(&x); }
#endif
template <class Number>
FLEXOR_INLINE Number table(const Number& x) {
  return x;
}

// Limits `value` to [lower, upper]; lower <= upper. A NaN comes back as NaN.
template <class T>
FLEXOR_INLINE T clamp(T value, T lower, T upper) {
  const T raised = value < lower ? lower : value;  // two steps: one maximum, one minimum, no branch
  return upper < raised ? upper : raised;
}

// a * m, accumulator + a * m, accumulator - a * m, for products and sums that fit. FLEXOR_AVR_ASSEMBLY: the
// same bits in a third fewer cycles than the compiler's.
#if defined(__AVR__) && defined(FLEXOR_AVR_ASSEMBLY)
#define FLEXOR_CROSS_PRODUCTS(add, carry)                                  \
  "mul %A[a], %B[m]\n\t" add " %B[s], r0\n\t" carry " %C[s], r1\n\t" carry \
  " %D[s], %[zero]\n\t"                                                    \
  "mul %B[a], %A[m]\n\t" add " %B[s], r0\n\t" carry " %C[s], r1\n\t" carry " %D[s], %[zero]\n\t"
#define FLEXOR_PRODUCT                                                                                  \
  "mul %A[a], %A[m]\n\tmovw %A[s], r0\n\tmul %B[a], %B[m]\n\tmovw %C[s], r0\n\t" FLEXOR_CROSS_PRODUCTS( \
      "add", "adc")
#define FLEXOR_ACCUMULATE(add, carry)                                                                  \
  "mul %A[a], %A[m]\n\t" add " %A[s], r0\n\t" carry " %B[s], r1\n\t" carry " %C[s], %[zero]\n\t" carry \
  " %D[s], %[zero]\n\tmul %B[a], %B[m]\n\t" add " %C[s], r0\n\t" carry                                 \
  " %D[s], r1\n\t" FLEXOR_CROSS_PRODUCTS(add, carry)
FLEXOR_INLINE int32_t multiply(uint16_t a, uint16_t m) {
  int32_t product;
  asm(FLEXOR_PRODUCT "clr r1"
      : [s] "=&r"(product)
      : [a] "r"(a), [m] "r"(m), [zero] "r"(static_cast<uint8_t>(0))
      : "r0");
  return product;
}
FLEXOR_INLINE int32_t multiply_add(int32_t accumulator, uint16_t a, uint16_t m) {
  asm(FLEXOR_ACCUMULATE("add", "adc") "clr r1"
      : [s] "+r"(accumulator)
      : [a] "r"(a), [m] "r"(m), [zero] "r"(static_cast<uint8_t>(0))
      : "r0");
  return accumulator;
}
FLEXOR_INLINE int32_t multiply_subtract(int32_t accumulator, uint16_t a, uint16_t m) {
  asm(FLEXOR_ACCUMULATE("sub", "sbc") "clr r1"
      : [s] "+r"(accumulator)
      : [a] "r"(a), [m] "r"(m), [zero] "r"(static_cast<uint8_t>(0))
      : "r0");
  return accumulator;
}
#undef FLEXOR_ACCUMULATE
#undef FLEXOR_PRODUCT
#undef FLEXOR_CROSS_PRODUCTS
#else
FLEXOR_INLINE int32_t multiply(uint16_t a, uint16_t m) {
  return static_cast<int32_t>(static_cast<uint32_t>(a) * m);
}
FLEXOR_INLINE int32_t multiply_add(int32_t accumulator, uint16_t a, uint16_t m) {
  return accumulator + multiply(a, m);
}
FLEXOR_INLINE int32_t multiply_subtract(int32_t accumulator, uint16_t a, uint16_t m) {
  return accumulator - multiply(a, m);
}
#endif

// a * b.
#if defined(__AVR__) && defined(FLEXOR_AVR_ASSEMBLY)
FLEXOR_INLINE int32_t multiply_signed(int16_t a, int16_t b) {
  int32_t product;
  asm("muls %B[a], %B[b]\n\tmovw %C[p], r0\n\tmul %A[a], %A[b]\n\tmovw %A[p], r0\n\t"
      "mulsu %B[a], %A[b]\n\tsbc %D[p], %[z]\n\tadd %B[p], r0\n\tadc %C[p], r1\n\tadc %D[p], %[z]\n\t"
      "mulsu %B[b], %A[a]\n\tsbc %D[p], %[z]\n\tadd %B[p], r0\n\tadc %C[p], r1\n\tadc %D[p], %[z]\n\tclr r1"
      : [p] "=&r"(product)
      : [a] "a"(a), [b] "a"(b), [z] "r"(static_cast<uint8_t>(0))
      : "r0");
  return product;
}
#else
FLEXOR_INLINE int32_t multiply_signed(int16_t a, int16_t b) { return static_cast<int32_t>(a) * b; }
#endif

// value / 2^16 rounded down, modulo 2^16. A shift would clear two registers that nobody asks for.
FLEXOR_INLINE uint16_t upper_half(int32_t value) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "halves are taken as they lie");
  uint16_t half[2];
  __builtin_memcpy(half, &value, sizeof(half));
  return half[1];
}

// floor(a * m / 2^16) without a 64-bit product: two 16x16 -> 32 multiplications.
// Domain: every a, every m; the result always fits.
#if defined(__AVR__) && defined(FLEXOR_AVR_ASSEMBLY)
FLEXOR_INLINE int32_t multiply_q16_here(int32_t a, uint16_t m) {
  int32_t product;
  uint8_t below;
  asm("mul %B[a], %B[m]\n\tmovw %A[p], r0\n\tmulsu %D[a], %B[m]\n\tmovw %C[p], r0\n\t"
      "mul %A[a], %A[m]\n\tmov %[b], r1\n\t"
      "mul %A[a], %B[m]\n\tadd %[b], r0\n\tadc %A[p], r1\n\tadc %B[p], %[z]\n\tadc %C[p], %[z]\n\tadc %D[p], "
      "%[z]\n\t"
      "mul %B[a], %A[m]\n\tadd %[b], r0\n\tadc %A[p], r1\n\tadc %B[p], %[z]\n\tadc %C[p], %[z]\n\tadc %D[p], "
      "%[z]\n\t"
      "mul %C[a], %A[m]\n\tadd %A[p], r0\n\tadc %B[p], r1\n\tadc %C[p], %[z]\n\tadc %D[p], %[z]\n\t"
      "mul %C[a], %B[m]\n\tadd %B[p], r0\n\tadc %C[p], r1\n\tadc %D[p], %[z]\n\t"
      "mulsu %D[a], %A[m]\n\tsbc %D[p], %[z]\n\tadd %B[p], r0\n\tadc %C[p], r1\n\tadc %D[p], %[z]\n\t"
      "clr r1"
      : [p] "=&r"(product), [b] "=&r"(below)
      : [a] "a"(a), [m] "a"(m), [z] "r"(static_cast<uint8_t>(0))
      : "r0");
  return product;
}
#else
FLEXOR_INLINE int32_t multiply_q16_here(int32_t a, uint16_t m) {
  const uint16_t high = upper_half(a);
  uint32_t product = static_cast<uint32_t>(multiply(high, m));
  if (a < 0) product -= static_cast<uint32_t>(m) << 16;  // high is negative
  return static_cast<int32_t>(product + upper_half(multiply(static_cast<uint16_t>(a), m)));
}
#endif

FLEXOR_PRODUCT_INLINE int32_t multiply_q16(int32_t a, uint16_t m) { return multiply_q16_here(a, m); }

// a * m / 2^16 rounded, halves upwards, modulo 2^16.
#if defined(__AVR__) && defined(FLEXOR_AVR_ASSEMBLY)
FLEXOR_INLINE int16_t multiply_round_q16(uint16_t a, int16_t m) {
  int16_t product;
  uint8_t below;
  asm("mulsu %B[m], %B[a]\n\tmovw %[p], r0\n\t"
      "mul %A[a], %A[m]\n\tldi %[b], 0x80\n\tadd %[b], r1\n\tadc %A[p], %[zero]\n\tadc %B[p], %[zero]\n\t"
      "mul %B[a], %A[m]\n\tadd %[b], r0\n\tadc %A[p], r1\n\tadc %B[p], %[zero]\n\t"
      "mulsu %B[m], %A[a]\n\tsbc %B[p], %[zero]\n\tadd %[b], r0\n\tadc %A[p], r1\n\tadc %B[p], %[zero]\n\t"
      "clr r1"
      : [p] "=&r"(product), [b] "=&d"(below)
      : [a] "a"(a), [m] "a"(m), [zero] "r"(static_cast<uint8_t>(0))
      : "r0");
  return product;
}
#else
FLEXOR_INLINE int16_t multiply_round_q16(uint16_t a, int16_t m) {
  const uint32_t rounded = static_cast<uint32_t>(multiply(a, static_cast<uint16_t>(m))) + 0x8000;
  const uint16_t product = upper_half(static_cast<int32_t>(rounded));
  return static_cast<int16_t>(m < 0 ? product - a : product);
}
#endif

// value 2^(16 - kDown). The compiler would shift step by step.
template <uint8_t kDown>
FLEXOR_INLINE int32_t widen(int16_t value) {
  return static_cast<int32_t>(static_cast<uint32_t>(static_cast<uint16_t>(value)) << 16) >> kDown;
}

// multiply_q16 with a signed factor: floor(a * m / 2^16) for m >= 0, its mirror image for m < 0.
FLEXOR_PRODUCT_INLINE int32_t multiply_q16(int32_t a, int16_t m) {
  return m >= 0 ? multiply_q16(a, static_cast<uint16_t>(m))
                : -multiply_q16(a, static_cast<uint16_t>(-static_cast<int32_t>(m)));
}

// value / 2^shift rounded to nearest, halves upwards; shift >= 1 and |value| < 2^30.
FLEXOR_INLINE int32_t round_shift(int32_t value, uint8_t shift) {
  if (shift > 8) {  // a microcontroller shifts by bytes, or step by step
    value >>= 8;
    shift = static_cast<uint8_t>(shift - 8);
  }
  return ((value >> (shift - 1)) + 1) >> 1;
}

// Saturates to int16.
FLEXOR_INLINE int16_t narrow(int32_t value) {
  const int16_t narrowed = static_cast<int16_t>(value);
  if (narrowed == value) return narrowed;
  return value < 0 ? INT16_MIN : INT16_MAX;
}

// a + b and a - b that stay inside int16; plain for floating point.
FLEXOR_INLINE int16_t add(int16_t a, int16_t b) {
  const int16_t sum = static_cast<int16_t>(static_cast<uint16_t>(a) + static_cast<uint16_t>(b));
  if (((a ^ sum) & (b ^ sum)) >= 0) return sum;
  return a < 0 ? INT16_MIN : INT16_MAX;
}
FLEXOR_INLINE int16_t subtract(int16_t a, int16_t b) {
  const int16_t difference = static_cast<int16_t>(static_cast<uint16_t>(a) - static_cast<uint16_t>(b));
  if (((a ^ b) & (a ^ difference)) >= 0) return difference;
  return a < 0 ? INT16_MIN : INT16_MAX;
}
template <class Real>
constexpr Real add(Real a, Real b) {
  return a + b;
}
template <class Real>
constexpr Real subtract(Real a, Real b) {
  return a - b;
}

// `bits` more fraction bits for an input; what no longer fits saturates, where the host has seen that it changes
// nothing.
FLEXOR_INLINE int16_t refine(int16_t v, uint8_t bits) {
  for (; bits > 0; --bits) v = add(v, v);
  return v;
}

// An angle with `bits` more fraction bits than the output, or less, as output.
FLEXOR_INLINE int16_t to_output(int16_t y, int8_t bits) {
  for (; bits < 0; ++bits) y = add(y, y);
  if (bits == 0) return y;
  for (; bits > 1; --bits) y = static_cast<int16_t>(y >> 1);
  return static_cast<int16_t>((y >> 1) + (y & 1));  // rounds halves upwards, and cannot overflow
}

}  // namespace core
}  // namespace flexor
