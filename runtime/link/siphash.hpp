// SipHash-2-4 (Aumasson, Bernstein, INDOCRYPT 2012): a keyed 64-bit tag for short messages. Test vectors of
// the reference implementation hold (a test).
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

struct Key {
  uint8_t bytes[16];  // written at deploy time, one for each pair of glove and hand
};

namespace detail {

inline uint64_t rotate(uint64_t x, uint8_t by) { return (x << by) | (x >> (64 - by)); }

struct SipState {
  uint64_t v0;
  uint64_t v1;
  uint64_t v2;
  uint64_t v3;

  void round() {
    v0 += v1;
    v1 = rotate(v1, 13) ^ v0;
    v0 = rotate(v0, 32);
    v2 += v3;
    v3 = rotate(v3, 16) ^ v2;
    v0 += v3;
    v3 = rotate(v3, 21) ^ v0;
    v2 += v1;
    v1 = rotate(v1, 17) ^ v2;
    v2 = rotate(v2, 32);
  }

  // Eight bytes, least significant first.
  void absorb(const uint8_t* m) {
    mix(v3, m);
    round();
    round();
    mix(v0, m);
  }

  // A loop over bytes, out of line: a third of the flash that 64-bit expressions take on a microcontroller.
  __attribute__((noinline)) static void mix(uint64_t& v, const uint8_t* m) {
    uint8_t* bytes = reinterpret_cast<uint8_t*>(&v);
    for (uint8_t i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(bytes[i] ^ m[i]);
  }
};

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "words are taken from bytes as they lie");

}  // namespace detail

inline uint64_t siphash24(const Key& key, const uint8_t* message, uint8_t size) {
  detail::SipState s = {0x736f6d6570736575ULL, 0x646f72616e646f6dULL, 0x6c7967656e657261ULL,
                        0x7465646279746573ULL};
  s.mix(s.v0, key.bytes);
  s.mix(s.v1, key.bytes + 8);
  s.mix(s.v2, key.bytes);
  s.mix(s.v3, key.bytes + 8);
  uint8_t left = size;
  for (; left >= 8; left = static_cast<uint8_t>(left - 8), message += 8) s.absorb(message);
  uint8_t last[8] = {0, 0, 0, 0, 0, 0, 0, size};
  for (uint8_t i = 0; i < left; ++i) last[i] = message[i];
  s.absorb(last);
  s.v2 ^= 0xff;
  for (uint8_t i = 0; i < 4; ++i) s.round();
  return s.v0 ^ s.v1 ^ s.v2 ^ s.v3;
}

}  // namespace link
}  // namespace flexor
