// What is on the wire: PROTOCOL.md, in code. A frame is head, body, tag (if guarded) and CRC, in COBS.
#pragma once

#include <stdint.h>

#include "runtime/core/crc16.hpp"
#include "runtime/link/cobs.hpp"
#include "runtime/link/siphash.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kVersion = 2;
constexpr uint8_t kHeadBytes = 3;  // what it is, and the low 16 bits of its counter
constexpr uint8_t kTagBytes = 6;
constexpr uint8_t kCrcBytes = 2;
constexpr uint8_t kMaxBody = 40;
constexpr uint8_t kMaxWire =
    kHeadBytes + kMaxBody + kTagBytes + kCrcBytes + 2;  // angles end before kMaxBody: their delimiter fits
constexpr uint32_t kCounters = static_cast<uint32_t>(1) << 24;  // frames that one challenge is good for

constexpr uint8_t wire_bytes(uint8_t body_bytes, bool guarded) {
  return static_cast<uint8_t>(kHeadBytes + body_bytes + (guarded ? kTagBytes : 0) + kCrcBytes + 2);
}

enum class Type : uint8_t {
  angles = 1,        // glove: of its joints
  readings = 2,      // glove: of its sensors, as the converter gives them
  state = 3,         // either board, of itself
  telemetry = 4,     // hand: of its fingers
  coefficients = 5,  // to the glove: a piece of a model; from it: what it wants next
  challenge = 6,     // to whom is to prove that what it sends is new
  request = 7,       // to the glove: what the sender wants
};

struct Head {
  Type type;
  bool guarded;      // has a tag
  bool listens;      // the sender is silent for a while after this frame: the other's turn to speak
  uint32_t counter;  // below kCounters; its low 16 bits travel
};

namespace detail {

constexpr uint16_t kCrcStart = 0x464c;  // a frame of version 1, which started at 0, is corrupt here
constexpr uint8_t kGuarded = 1 << 4;
constexpr uint8_t kListens = 1 << 5;

inline uint8_t first_byte(const Head& head) {
  return static_cast<uint8_t>(static_cast<uint8_t>(head.type) | (head.guarded ? kGuarded : 0) |
                              (head.listens ? kListens : 0) | (kVersion << 6));
}

inline uint16_t crc_of(const uint8_t* bytes, uint8_t size) { return core::crc16(bytes, size, kCrcStart); }

}  // namespace detail

// A frame while it is made or read. What the tag is over lies as it is hashed: first byte, counter (3 bytes,
// least significant first), body. On the wire the counter's highest byte is left out.
class Packet {
 public:
  uint8_t* body() { return bytes_ + 1 + kHeadBytes; }
  const uint8_t* body() const { return bytes_ + 1 + kHeadBytes; }

  // Body to wire, which has room for kMaxWire; returns the bytes written. `key` null: not guarded.
  uint8_t seal(Head head, uint8_t body_bytes, const Key* key, uint8_t* wire) {
    head.guarded = key != nullptr;
    place(detail::first_byte(head), head.counter);
    uint8_t* end = body() + body_bytes;
    if (head.guarded) {
      const uint64_t tag = tag_of(*key, body_bytes);
      __builtin_memcpy(end, &tag, kTagBytes);
      end += kTagBytes;
    }
    to_wire_order();
    const uint16_t crc = detail::crc_of(bytes_ + 1, static_cast<uint8_t>(end - bytes_ - 1));
    *end++ = static_cast<uint8_t>(crc >> 8);
    *end++ = static_cast<uint8_t>(crc);
    return cobs_encode(bytes_ + 1, static_cast<uint8_t>(end - bytes_ - 1), wire);
  }

  // The tag of a frame that came, whose counter is `counter`. Compares all bytes whatever the first ones are.
  bool fits(const Key& key, uint32_t counter, uint8_t body_bytes) {
    place(bytes_[1], counter);
    const uint64_t tag = tag_of(key, body_bytes);
    to_wire_order();
    const uint8_t* expected = reinterpret_cast<const uint8_t*>(&tag);
    const uint8_t* came = body() + body_bytes;
    uint8_t difference = 0;
    for (uint8_t i = 0; i < kTagBytes; ++i) {
      difference = static_cast<uint8_t>(difference | (came[i] ^ expected[i]));
    }
    return difference == 0;
  }

  // Where the bytes of the wire go, kMaxWire - 1 of them at most; in its order.
  uint8_t* wire() { return bytes_ + 1; }
  uint8_t first() const { return bytes_[1]; }
  uint16_t sequence() const { return static_cast<uint16_t>(bytes_[2] | (bytes_[3] << 8)); }

 private:
  uint64_t tag_of(const Key& key, uint8_t body_bytes) const {
    return siphash24(key, bytes_, static_cast<uint8_t>(1 + kHeadBytes + body_bytes));
  }
  void place(uint8_t first, uint32_t counter) {
    bytes_[0] = first;
    bytes_[1] = static_cast<uint8_t>(counter);
    bytes_[2] = static_cast<uint8_t>(counter >> 8);
    bytes_[3] = static_cast<uint8_t>(counter >> 16);
  }
  void to_wire_order() {
    bytes_[3] = bytes_[2];
    bytes_[2] = bytes_[1];
    bytes_[1] = bytes_[0];
  }

  uint8_t bytes_[kMaxWire];
};

}  // namespace link
}  // namespace flexor
