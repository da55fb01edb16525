// Numbers where they lie: in RAM or, on a microcontroller, in flash. A type for each place, so that the same
// arithmetic reads either.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace core {

#ifdef __AVR__
#define FLEXOR_IN_FLASH PROGMEM
#else
#define FLEXOR_IN_FLASH
#endif

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are read as they lie");

// byte, word: at an address. next_byte, next_word: and on behind it. is_far: not in RAM.
struct Ram {
  static bool is_far(const uint8_t*) { return false; }
  static const uint8_t* address(const uint8_t* at) { return at; }
  FLEXOR_INLINE static uint8_t byte(const uint8_t* at) { return *at; }
  FLEXOR_INLINE static uint16_t word(const uint8_t* at) {
    uint16_t x;
    __builtin_memcpy(&x, at, sizeof(x));
    return x;
  }
  FLEXOR_INLINE static uint8_t next_byte(const uint8_t*& at) { return *at++; }
  FLEXOR_INLINE static uint16_t next_word(const uint8_t*& at) {
    const uint16_t x = word(at);
    at += 2;
    return x;
  }
};

#ifdef __AVR__
struct Flash {
  static bool is_far(const uint8_t*) { return true; }
  static const uint8_t* address(const uint8_t* at) { return at; }
  FLEXOR_INLINE static uint8_t byte(const uint8_t* at) { return pgm_read_byte(at); }
  FLEXOR_INLINE static uint16_t word(const uint8_t* at) { return pgm_read_word(at); }
  FLEXOR_INLINE static uint8_t next_byte(const uint8_t*& at) {
    uint8_t x;
    asm("lpm %0, Z+" : "=r"(x), "+z"(at));
    return x;
  }
  FLEXOR_INLINE static uint16_t next_word(const uint8_t*& at) {
    uint16_t x;
    asm("lpm %A0, Z+\n\tlpm %B0, Z+" : "=&r"(x), "+z"(at));
    return x;
  }
};

// Either, by the address: flash below 0x8000, RAM above. For what is not read again and again.
struct Anywhere {
  static const uint8_t* in_ram(const uint8_t* at) { return at + 0x8000; }
  static bool is_far(const uint8_t* at) { return (reinterpret_cast<uint16_t>(at) & 0x8000) == 0; }
  static const uint8_t* address(const uint8_t* at) { return is_far(at) ? at : at - 0x8000; }
  FLEXOR_SHARED static uint8_t byte(const uint8_t* at) {
    return is_far(at) ? Flash::byte(at) : Ram::byte(address(at));
  }
  FLEXOR_SHARED static uint16_t word(const uint8_t* at) {
    return is_far(at) ? Flash::word(at) : Ram::word(address(at));
  }
  FLEXOR_INLINE static uint8_t next_byte(const uint8_t*& at) { return byte(at++); }
  FLEXOR_INLINE static uint16_t next_word(const uint8_t*& at) {
    at += 2;
    return word(at - 2);
  }
};
#else
struct Flash : Ram {
  static bool is_far(const uint8_t*) { return true; }
};
struct Anywhere : Flash {
  static const uint8_t* in_ram(const uint8_t* at) { return at; }
};
#endif

// A row of 16-bit numbers, at any address.
template <class Place, class Number>
struct Words {
  const uint8_t* at;

  FLEXOR_INLINE Number operator[](uint8_t i) const { return static_cast<Number>(Place::word(at + 2 * i)); }
  FLEXOR_INLINE Number at_offset(uint8_t bytes) const { return static_cast<Number>(Place::word(at + bytes)); }
  FLEXOR_INLINE Words operator+(uint8_t n) const { return {at + 2 * n}; }
};

// Of a table that is a constant of the program.
template <class Number>
FLEXOR_INLINE Words<Flash, Number> in_flash(const Number* table) {
  return {reinterpret_cast<const uint8_t*>(table)};
}

}  // namespace core
}  // namespace flexor
