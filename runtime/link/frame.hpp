// One frame from glove to hand: PROTOCOL.md, in code.
#pragma once

#include <stdint.h>

#include "runtime/link/cobs.hpp"
#include "runtime/link/crc16.hpp"
#include "runtime/link/siphash.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kVersion = 1;
constexpr uint8_t kFingers = 5;
constexpr int16_t kMaxAngle = 4095;  // Q4 degrees, 255.94
constexpr uint8_t kTagBytes = 7;
constexpr uint8_t kBodyBytes = 13;                            // sequence, time, angles, statuses, version
constexpr uint8_t kPlainBytes = kBodyBytes + 2;               // and CRC
constexpr uint8_t kSealedBytes = kBodyBytes + kTagBytes + 2;  // and tag and CRC
constexpr uint8_t kWirePlain = kPlainBytes + 2;               // 17: and COBS
constexpr uint8_t kWireSealed = kSealedBytes + 2;             // 24

enum class SensorStatus : uint8_t { ok = 0, open = 1, short_circuit = 2, stuck = 3 };

struct Frame {
  uint32_t counter;         // epoch << 16 | sequence; only the sequence is on the wire
  uint16_t time_ms;         // sender's clock, wraps every 65.5 s
  int16_t angle[kFingers];  // Q4 degrees, 0 .. kMaxAngle
  SensorStatus status[kFingers];
};

namespace detail {

// Bits `at` .. `at + count - 1` of a little-endian field, count <= 12.
inline void put_bits(uint8_t* field, uint8_t at, uint8_t count, uint16_t value) {
  for (uint8_t i = 0; i < count; ++i, ++at) {
    const uint8_t mask = static_cast<uint8_t>(1 << (at & 7));
    if ((value >> i) & 1) {
      field[at >> 3] = static_cast<uint8_t>(field[at >> 3] | mask);
    } else {
      field[at >> 3] = static_cast<uint8_t>(field[at >> 3] & ~mask);
    }
  }
}

inline uint16_t get_bits(const uint8_t* field, uint8_t at, uint8_t count) {
  uint16_t value = 0;
  for (uint8_t i = 0; i < count; ++i, ++at) {
    value = static_cast<uint16_t>(value | (((field[at >> 3] >> (at & 7)) & 1) << i));
  }
  return value;
}

// counter, then everything of the body but the sequence: 15 bytes, two blocks of SipHash.
inline uint64_t tag_of(const Key& key, uint32_t counter, const uint8_t* body) {
  uint8_t message[4 + kBodyBytes - 2];
  for (uint8_t i = 0; i < 4; ++i) message[i] = static_cast<uint8_t>(counter >> (8 * i));
  for (uint8_t i = 2; i < kBodyBytes; ++i) message[i + 2] = body[i];
  return siphash24(key, message, sizeof(message));
}

}  // namespace detail

// Frame to wire; `key` null: not authenticated. `wire` has room for kWireSealed; returns the bytes written.
inline uint8_t encode(const Frame& frame, const Key* key, uint8_t* wire) {
  uint8_t payload[kSealedBytes];
  payload[0] = static_cast<uint8_t>(frame.counter);
  payload[1] = static_cast<uint8_t>(frame.counter >> 8);
  payload[2] = static_cast<uint8_t>(frame.time_ms);
  payload[3] = static_cast<uint8_t>(frame.time_ms >> 8);
  for (uint8_t i = 0; i < kFingers; ++i) {
    int16_t angle = frame.angle[i] < 0 ? static_cast<int16_t>(0) : frame.angle[i];
    if (angle > kMaxAngle) angle = kMaxAngle;
    detail::put_bits(payload + 4, static_cast<uint8_t>(12 * i), 12, static_cast<uint16_t>(angle));
    detail::put_bits(payload + 4, static_cast<uint8_t>(60 + 2 * i), 2,
                     static_cast<uint16_t>(frame.status[i]));
  }
  detail::put_bits(payload + 4, 70, 2, kVersion);
  uint8_t size = kBodyBytes;
  if (key != nullptr) {
    const uint64_t tag = detail::tag_of(*key, frame.counter, payload);
    for (uint8_t i = 0; i < kTagBytes; ++i) payload[size++] = static_cast<uint8_t>(tag >> (8 * i));
  }
  const uint16_t crc = crc16(payload, size);
  payload[size++] = static_cast<uint8_t>(crc >> 8);
  payload[size++] = static_cast<uint8_t>(crc);
  return cobs_encode(payload, size, wire);
}

}  // namespace link
}  // namespace flexor
