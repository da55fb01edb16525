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

// The field of 72 bits: five angles of 12, five states of 2, the version.
inline void pack(const Frame& frame, uint8_t* field) {
  uint16_t angle[kFingers];
  uint8_t status[kFingers];
  for (uint8_t i = 0; i < kFingers; ++i) {
    const int16_t raised = frame.angle[i] < 0 ? static_cast<int16_t>(0) : frame.angle[i];
    angle[i] = static_cast<uint16_t>(raised > kMaxAngle ? kMaxAngle : raised);
    status[i] = static_cast<uint8_t>(frame.status[i]);
  }
  for (uint8_t i = 0; i < kFingers - 1; i = static_cast<uint8_t>(i + 2)) {
    *field++ = static_cast<uint8_t>(angle[i]);
    *field++ = static_cast<uint8_t>((angle[i] >> 8) | (angle[i + 1] << 4));
    *field++ = static_cast<uint8_t>(angle[i + 1] >> 4);
  }
  *field++ = static_cast<uint8_t>(angle[4]);
  *field++ = static_cast<uint8_t>((angle[4] >> 8) | (status[0] << 4) | (status[1] << 6));
  *field = static_cast<uint8_t>(status[2] | (status[3] << 2) | (status[4] << 4) | (kVersion << 6));
}

inline uint8_t version_of(const uint8_t* field) { return field[8] >> 6; }

inline void unpack(const uint8_t* field, Frame& frame) {
  const auto state = [&](uint8_t finger, uint8_t byte, uint8_t shift) {
    frame.status[finger] = static_cast<SensorStatus>((field[byte] >> shift) & 3);
  };
  state(0, 7, 4);
  state(1, 7, 6);
  state(2, 8, 0);
  state(3, 8, 2);
  state(4, 8, 4);
  for (uint8_t i = 0; i < kFingers; ++i) {
    const uint8_t* byte = field + i + i / 2;  // 1.5 bytes each
    const uint16_t both = static_cast<uint16_t>(byte[0] | (byte[1] << 8));
    frame.angle[i] = static_cast<int16_t>(i % 2 == 0 ? both & 0xfff : both >> 4);
  }
}

// counter, then everything of the body but the sequence: 15 bytes, two blocks of SipHash.
inline uint64_t tag_of(const Key& key, uint32_t counter, const uint8_t* body) {
  uint8_t message[4 + kBodyBytes - 2];
  __builtin_memcpy(message, &counter, sizeof(counter));  // least significant first
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
  detail::pack(frame, payload + 4);
  uint8_t size = kBodyBytes;
  if (key != nullptr) {
    const uint64_t tag = detail::tag_of(*key, frame.counter, payload);
    __builtin_memcpy(payload + size, &tag, kTagBytes);
    size = kBodyBytes + kTagBytes;
  }
  const uint16_t crc = crc16(payload, size);
  payload[size++] = static_cast<uint8_t>(crc >> 8);
  payload[size++] = static_cast<uint8_t>(crc);
  return cobs_encode(payload, size, wire);
}

}  // namespace link
}  // namespace flexor
