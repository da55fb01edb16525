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

  __attribute__((noinline)) void absorb(uint64_t m) {
    v3 ^= m;
    round();
    round();
    v0 ^= m;
  }
};

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "bytes are copied, least significant first, as they lie");

// Up to eight bytes, least significant first.
inline uint64_t load(const uint8_t* bytes, uint8_t count) {
  uint64_t x = 0;
  __builtin_memcpy(&x, bytes, count);
  return x;
}

}  // namespace detail

inline uint64_t siphash24(const Key& key, const uint8_t* message, uint8_t size) {
  const uint64_t k0 = detail::load(key.bytes, 8);
  const uint64_t k1 = detail::load(key.bytes + 8, 8);
  detail::SipState s = {k0 ^ 0x736f6d6570736575ULL, k1 ^ 0x646f72616e646f6dULL, k0 ^ 0x6c7967656e657261ULL,
                        k1 ^ 0x7465646279746573ULL};
  uint8_t at = 0;
  for (; static_cast<uint8_t>(size - at) >= 8; at = static_cast<uint8_t>(at + 8))
    s.absorb(detail::load(message + at, 8));
  s.absorb(detail::load(message + at, static_cast<uint8_t>(size - at)) | (static_cast<uint64_t>(size) << 56));
  s.v2 ^= 0xff;
  for (uint8_t i = 0; i < 4; ++i) s.round();
  return s.v0 ^ s.v1 ^ s.v2 ^ s.v3;
}

}  // namespace link
}  // namespace flexor
