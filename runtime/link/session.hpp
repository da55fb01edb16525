// Freshness: who is to be believed answers a challenge that was never given before.
//
// A challenge is a nonce. Both ends make a key of it and of the pair's,
//   half_i = SipHash(pair, "S" | nonce | i),  i = 0, 1,   session = half_0 | half_1
// and every frame that answers is tagged with that key and a counter that only grows. Frames from before the
// challenge fit no later key; within a session a counter is believed once.
#pragma once

#include "runtime/link/siphash.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kNonceBytes = 8;

struct Nonce {
  uint8_t bytes[kNonceBytes];

  bool operator==(const Nonce& other) const { return __builtin_memcmp(bytes, other.bytes, kNonceBytes) == 0; }
  // Of one NonceSource's: given after `other`. The count wraps.
  bool is_newer_than(const Nonce& other) const { return static_cast<int32_t>(count() - other.count()) > 0; }

 private:
  uint32_t count() const {
    uint32_t out;
    __builtin_memcpy(&out, bytes, sizeof(out));
    return out;
  }
};

class Session {
 public:
  void start(const Nonce& nonce) {
    nonce_ = nonce;
    halves_ = 0;
  }

  // One SipHash; two are needed.
  void derive(const Key& pair) {
    uint8_t message[2 + kNonceBytes];
    message[0] = 'S';
    __builtin_memcpy(message + 1, nonce_.bytes, kNonceBytes);
    message[1 + kNonceBytes] = halves_;
    const uint64_t half = siphash24(pair, message, sizeof(message));
    __builtin_memcpy(key_.bytes + 8 * halves_, &half, sizeof(half));
    ++halves_;
  }

  bool started() const { return halves_ != kNone; }
  bool ready() const { return halves_ == 2; }
  const Key& key() const { return key_; }
  const Nonce& nonce() const { return nonce_; }

 private:
  static constexpr uint8_t kNone = 255;

  Nonce nonce_ = {};
  Key key_ = {};
  uint8_t halves_ = kNone;
};

// Nonces that do not come twice: a count of this board's starts that lasts, the challenge's number, and what
// the converter's noise left in a pool, which guards a board whose memory was erased.
//   nonce = starts (3 bytes) | number | pool (4 bytes)
class NonceSource {
 public:
  void start(uint32_t starts) { starts_ = starts; }

  // Any number that nobody can foretell in its last bits.
  // Turned left by seven bits: by eight and back by one, as a microcontroller shifts by bytes at once.
  void stir(uint16_t noise) {
    const uint32_t turned = (pool_ << 8) | (pool_ >> 24);
    pool_ = ((turned >> 1) | ((turned & 1) != 0 ? 0x80000000 : 0)) ^ noise;
  }

  Nonce next() {
    if (++number_ == 0) ++starts_;
    Nonce out;
    const uint32_t count = (starts_ << 8) | number_;
    __builtin_memcpy(out.bytes, &count, sizeof(count));
    __builtin_memcpy(out.bytes + sizeof(count), &pool_, sizeof(pool_));
    return out;
  }

  // The pool, folded.
  uint8_t noise() const {
    const uint16_t half = static_cast<uint16_t>(pool_ ^ (pool_ >> 16));
    return static_cast<uint8_t>(half ^ (half >> 8));
  }

  // To be kept before a nonce of it is given away.
  uint32_t starts() const { return starts_; }

 private:
  uint32_t starts_ = 0;
  uint32_t pool_ = 0;
  uint8_t number_ = 0;
};

}  // namespace link
}  // namespace flexor
