// What the bodies of frames carry, field by field; PROTOCOL.md has the tables.
#pragma once

#include "runtime/link/frame.hpp"
#include "runtime/link/session.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kFingers = 5;      // of this glove and this hand; frames carry any number of joints
constexpr int16_t kMaxAngle = 4095;  // Q4 degrees, 255.94

enum class SensorStatus : uint8_t { ok = 0, open = 1, short_circuit = 2, stuck = 3 };

// One sample of a glove.
struct Frame {
  uint32_t counter;
  uint16_t time_ms;         // sender's clock, wraps every 65.5 s
  int16_t angle[kFingers];  // Q4 degrees, 0 .. kMaxAngle
  SensorStatus status[kFingers];
};

namespace detail {

// Fields of up to 16 bits one after the other, least significant bit first.
class BitWriter {
 public:
  explicit BitWriter(uint8_t* out) : out_(out) {}
  void add(uint16_t value, uint8_t bits) {
    for (uint8_t i = 0; i < bits; ++i) {
      if (filled_ == 0) *out_ = 0;
      if (value & 1) *out_ = static_cast<uint8_t>(*out_ | 1 << filled_);
      value = static_cast<uint16_t>(value >> 1);
      filled_ = static_cast<uint8_t>((filled_ + 1) & 7);
      if (filled_ == 0) ++out_;
    }
  }

 private:
  uint8_t* out_;
  uint8_t filled_ = 0;
};

class BitReader {
 public:
  explicit BitReader(const uint8_t* in) : in_(in) {}
  // Bytes at a time: the hand's loops wait for it.
  uint16_t take(uint8_t bits) {
    const uint8_t reach = static_cast<uint8_t>(taken_ + bits);
    uint32_t window = in_[0];
    if (reach > 8) window |= static_cast<uint32_t>(in_[1]) << 8;
    if (reach > 16) window |= static_cast<uint32_t>(in_[2]) << 16;
    window >>= taken_;
    in_ += reach >> 3;
    taken_ = reach & 7;
    return static_cast<uint16_t>(window & ((static_cast<uint32_t>(1) << bits) - 1));
  }

 private:
  const uint8_t* in_;
  uint8_t taken_ = 0;
};

constexpr uint8_t kAngleBits = 14;  // 12 of angle, 2 of state
constexpr uint8_t kReadingBits = 10;

constexpr uint8_t bytes_of(uint8_t fields, uint8_t bits) {
  return static_cast<uint8_t>((fields * bits + 7) / 8);
}

inline void put16(uint8_t* out, uint16_t value) {
  out[0] = static_cast<uint8_t>(value);
  out[1] = static_cast<uint8_t>(value >> 8);
}
inline uint16_t get16(const uint8_t* in) { return static_cast<uint16_t>(in[0] | (in[1] << 8)); }

}  // namespace detail

constexpr uint8_t angles_bytes(uint8_t joints) {
  return static_cast<uint8_t>(2 + detail::bytes_of(joints, detail::kAngleBits));
}
constexpr uint8_t readings_bytes(uint8_t sensors) {
  return static_cast<uint8_t>(2 + detail::bytes_of(sensors, detail::kReadingBits));
}
constexpr uint8_t kMaxJoints = 21;
static_assert(angles_bytes(kMaxJoints) <= kMaxBody, "a hand's joints fit a frame");

// How many joints a body of so many bytes has; 0: none fits.
inline uint8_t joints_in(uint8_t body_bytes) {
  if (body_bytes < angles_bytes(1) || body_bytes > angles_bytes(kMaxJoints)) return 0;
  const uint8_t joints = static_cast<uint8_t>((body_bytes - 2) * 8 / detail::kAngleBits);
  return angles_bytes(joints) == body_bytes ? joints : static_cast<uint8_t>(0);
}

// Angles in Q4 degrees, clamped to 0 .. kMaxAngle; returns the body's bytes.
inline uint8_t put_angles(uint16_t time_ms, const int16_t* angle, const SensorStatus* status, uint8_t joints,
                          uint8_t* body) {
  detail::put16(body, time_ms);
  detail::BitWriter bits(body + 2);
  for (uint8_t i = 0; i < joints; ++i) {
    const int16_t raised = angle[i] < 0 ? static_cast<int16_t>(0) : angle[i];
    bits.add(static_cast<uint16_t>(raised > kMaxAngle ? kMaxAngle : raised), 12);
    bits.add(static_cast<uint16_t>(status[i]), 2);
  }
  return angles_bytes(joints);
}

// Of the first `joints` of the body, which has at least as many.
inline void get_angles(const uint8_t* body, uint8_t joints, uint16_t& time_ms, int16_t* angle,
                       SensorStatus* status) {
  time_ms = detail::get16(body);
  detail::BitReader bits(body + 2);
  for (uint8_t i = 0; i < joints; ++i) {
    angle[i] = static_cast<int16_t>(bits.take(12));
    status[i] = static_cast<SensorStatus>(bits.take(2));
  }
}

// Readings of 10 bits; returns the body's bytes.
inline uint8_t put_readings(uint16_t time_ms, const uint16_t* counts, uint8_t sensors, uint8_t* body) {
  detail::put16(body, time_ms);
  detail::BitWriter bits(body + 2);
  for (uint8_t i = 0; i < sensors; ++i) bits.add(counts[i], detail::kReadingBits);
  return readings_bytes(sensors);
}

inline void get_readings(const uint8_t* body, uint8_t sensors, uint16_t& time_ms, uint16_t* counts) {
  time_ms = detail::get16(body);
  detail::BitReader bits(body + 2);
  for (uint8_t i = 0; i < sensors; ++i) counts[i] = bits.take(detail::kReadingBits);
}

// What a request asks of a glove; the body is this byte.
enum class Request : uint8_t {
  state = 1,         // once
  readings = 2,      // beside each frame, for a second
  coefficients = 3,  // to be challenged, and sent a model
};

enum class BoardKind : uint8_t { glove = 0, hand = 1 };

// A board of itself.
struct State {
  static constexpr uint8_t kBytes = 6;
  static constexpr int8_t kNoTemperature = -128;
  static uint16_t uptime(uint32_t s) { return s < UINT16_MAX ? static_cast<uint16_t>(s) : UINT16_MAX; }

  BoardKind board;
  bool in_touch;  // with the other end: what it sends is believed, or it has been challenged
  bool has_key;
  uint8_t reset_cause;  // as MCUSR: bit 0 power-on, 1 reset pin, 2 brown-out, 3 watchdog
  uint8_t faults;       // of the board; the hand's README has them
  int8_t temperature_C;
  uint8_t supply_20mV;  // 0: not measured
  uint16_t uptime_s;    // 65535: that or longer
};

inline uint8_t put_state(const State& s, uint8_t* body) {
  body[0] = static_cast<uint8_t>(static_cast<uint8_t>(s.board) | (s.in_touch ? 2 : 0) | (s.has_key ? 4 : 0) |
                                 s.reset_cause << 4);
  body[1] = s.faults;
  body[2] = static_cast<uint8_t>(s.temperature_C);
  body[3] = s.supply_20mV;
  detail::put16(body + 4, s.uptime_s);
  return State::kBytes;
}

inline State get_state(const uint8_t* body) {
  return {static_cast<BoardKind>(body[0] & 1),
          (body[0] & 2) != 0,
          (body[0] & 4) != 0,
          static_cast<uint8_t>(body[0] >> 4),
          body[1],
          static_cast<int8_t>(body[2]),
          body[3],
          detail::get16(body + 4)};
}

// One finger of the hand: 12 bits of angle, 4 of fault, 8 of duty.
struct FingerTelemetry {
  static constexpr uint8_t kBytes = 3;

  int16_t angle;  // Q4 degrees, 0 .. kMaxAngle
  int8_t duty;    // 127: the supply's whole voltage, to flex
  uint8_t fault;  // hand::Fault
};

// Time, faults of the board, and its fingers; returns the body's bytes.
inline uint8_t put_telemetry(uint16_t time_ms, uint8_t faults, const FingerTelemetry* finger, uint8_t fingers,
                             uint8_t* body) {
  detail::put16(body, time_ms);
  body[2] = faults;
  uint8_t* out = body + 3;
  for (uint8_t i = 0; i < fingers; ++i, out += FingerTelemetry::kBytes) {
    detail::put16(out, static_cast<uint16_t>(finger[i].angle | finger[i].fault << 12));
    out[2] = static_cast<uint8_t>(finger[i].duty);
  }
  return static_cast<uint8_t>(out - body);
}

inline FingerTelemetry get_telemetry(const uint8_t* body, uint8_t finger) {
  const uint8_t* in = body + 3 + finger * FingerTelemetry::kBytes;
  const uint16_t both = detail::get16(in);
  return {static_cast<int16_t>(both & 0xfff), static_cast<int8_t>(in[2]), static_cast<uint8_t>(both >> 12)};
}

constexpr uint8_t telemetry_bytes(uint8_t fingers) {
  return static_cast<uint8_t>(3 + fingers * FingerTelemetry::kBytes);
}

// A piece of a model on its way to the glove, which is made of parts.
struct Piece {
  static constexpr uint8_t kHead = 4;
  static constexpr uint8_t kMost = 24;  // bytes of the model: less than a turn on a radio of 9600 baud

  uint16_t size;  // of the model
  uint16_t offset;
  uint8_t count;
  const uint8_t* bytes;
};

inline uint8_t put_piece(const Piece& piece, uint8_t* body) {
  detail::put16(body, piece.size);
  detail::put16(body + 2, piece.offset);
  for (uint8_t i = 0; i < piece.count; ++i) body[Piece::kHead + i] = piece.bytes[i];
  return static_cast<uint8_t>(Piece::kHead + piece.count);
}

// count 0: no piece.
inline Piece get_piece(const uint8_t* body, uint8_t body_bytes) {
  if (body_bytes <= Piece::kHead || body_bytes > Piece::kHead + Piece::kMost) return {0, 0, 0, nullptr};
  return {detail::get16(body), detail::get16(body + 2), static_cast<uint8_t>(body_bytes - Piece::kHead),
          body + Piece::kHead};
}

// What a glove takes, with the nonce that pieces answer.
struct Offer {
  static constexpr uint8_t kBytes = 1 + kNonceBytes + 5 + 2 * kFingers;

  Nonce nonce;
  uint16_t room;  // bytes of a model
  uint8_t rate_hz;
  uint16_t model;                  // CRC-16 of the one in flash
  uint16_t calibration[kFingers];  // of each sensor, as its settings have it
};

// How far a model has come.
struct Receipt {
  static constexpr uint8_t kBytes = 4;

  uint16_t received;  // bytes
  uint8_t stage;      // 0 goes on, 1 the model runs; others: why it cannot
};

// First byte of what a glove sends in frames of coefficients.
enum class Answer : uint8_t { offer = 0, receipt = 1 };

inline uint8_t put_offer(const Offer& o, uint8_t* body) {
  body[0] = static_cast<uint8_t>(Answer::offer);
  __builtin_memcpy(body + 1, o.nonce.bytes, kNonceBytes);
  uint8_t* out = body + 1 + kNonceBytes;
  detail::put16(out, o.room);
  out[2] = o.rate_hz;
  detail::put16(out + 3, o.model);
  for (uint8_t i = 0; i < kFingers; ++i) detail::put16(out + 5 + 2 * i, o.calibration[i]);
  return Offer::kBytes;
}

inline Offer get_offer(const uint8_t* body) {
  Offer o = {};
  __builtin_memcpy(o.nonce.bytes, body + 1, kNonceBytes);
  const uint8_t* in = body + 1 + kNonceBytes;
  o.room = detail::get16(in);
  o.rate_hz = in[2];
  o.model = detail::get16(in + 3);
  for (uint8_t i = 0; i < kFingers; ++i) o.calibration[i] = detail::get16(in + 5 + 2 * i);
  return o;
}

inline uint8_t put_receipt(const Receipt& r, uint8_t* body) {
  body[0] = static_cast<uint8_t>(Answer::receipt);
  detail::put16(body + 1, r.received);
  body[3] = r.stage;
  return Receipt::kBytes;
}

inline Receipt get_receipt(const uint8_t* body) { return {detail::get16(body + 1), body[3]}; }

// Of a frame of five angles on the wire.
constexpr uint8_t frame_bytes(bool guarded) { return 1 + wire_bytes(angles_bytes(kFingers), guarded); }

// Frame to wire; `key` null: not guarded.
inline uint8_t encode(const Frame& frame, bool listens, const Key* key, uint8_t* wire) {
  Packet packet;
  const uint8_t bytes = put_angles(frame.time_ms, frame.angle, frame.status, kFingers, packet.body());
  return packet.seal({Type::angles, false, listens, frame.counter}, bytes, key, wire);
}

}  // namespace link
}  // namespace flexor
