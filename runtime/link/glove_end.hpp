// The glove's end of the link: it answers whoever proves to have the pair's key, and keeps nothing.
//
// A session ends for a challenge that the hand gave later, at once. An earlier one is a recording, or the first of a hand
// whose memory was erased: it ends the session only when no telemetry, which a hand sends in touch alone, has come for
// `settled_frames`.
//
// With a key it sends angles only once it has been challenged, and starts its counter again with each new
// nonce; until then, and at times after, it sends its state. Without a key it sends them from the start.
#pragma once

#include "runtime/link/receiver.hpp"

namespace flexor {
namespace link {

class GloveEnd {
 public:
  explicit GloveEnd(const Key* pair, uint16_t settled_frames = 1000)
      : pair_(pair), settled_frames_(settled_frames) {}

  // One byte. pending: a whole frame for the caller, challenges aside, which are answered here (three SipHashes).
  Received push(uint8_t byte) {
    const Received result = reader_.push(byte);
    if (result == Received::pending && reader_.type() == Type::telemetry) quiet_frames_ = 0;
    if (result != Received::pending || reader_.type() != Type::challenge) return result;
    take_challenge();
    return Received::other;
  }

  bool in_touch() const { return pair_ == nullptr || (session_.ready() && counter_ < kCounters); }

  // To wire, which has room for kMaxWire; returns the bytes written. Only while in_touch().
  uint8_t angles(Frame& frame, bool listens, uint8_t* wire) {
    frame.counter = counter_++;
    if (quiet_frames_ < settled_frames_) ++quiet_frames_;
    wire[0] = kDelimiter;  // what somebody sent in the gap would else spoil this
    return static_cast<uint8_t>(
        1 + encode(frame, listens, pair_ == nullptr ? nullptr : &session_.key(), wire + 1));
  }
  // Anything else that nobody moves by: not guarded.
  static uint8_t seal(Type type, Packet& packet, uint8_t body_bytes, bool listens, uint8_t* wire) {
    return packet.seal({type, false, listens, 0}, body_bytes, nullptr, wire);
  }

  uint8_t state(uint8_t reset_cause, uint32_t uptime_s, uint8_t* wire, bool listens = true) const {
    State state = {};
    state.board = BoardKind::glove;
    state.in_touch = in_touch();
    state.has_key = pair_ != nullptr;
    state.reset_cause = reset_cause;
    state.temperature_C = State::kNoTemperature;
    state.uptime_s = State::uptime(uptime_s);
    Packet packet;
    wire[0] = kDelimiter;  // what a start cut off would else spoil this
    return static_cast<uint8_t>(
        1 + seal(Type::state, packet, put_state(state, packet.body()), listens, wire + 1));
  }

  PacketReader& packet() { return reader_; }
  const Key* pair() const { return pair_; }

 private:
  void take_challenge() {
    if (pair_ == nullptr || !reader_.guarded() || reader_.body_bytes() != kNonceBytes) return;
    Nonce nonce;
    __builtin_memcpy(nonce.bytes, reader_.body(), kNonceBytes);
    if (session_.started() && (nonce == session_.nonce() || !may_follow(nonce))) return;
    if (!reader_.fits(*pair_, reader_.sequence())) return;
    session_.start(nonce);
    while (!session_.ready()) session_.derive(*pair_);
    counter_ = 0;
    quiet_frames_ = 0;
  }

  bool may_follow(const Nonce& nonce) const {
    return nonce.is_newer_than(session_.nonce()) || quiet_frames_ == settled_frames_ || !in_touch();
  }

  const Key* pair_;
  uint16_t settled_frames_;
  Session session_;
  uint32_t counter_ = 0;
  uint16_t quiet_frames_ = 0;  // since telemetry, of this session
  PacketReader reader_;
};

}  // namespace link
}  // namespace flexor
