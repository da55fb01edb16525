// The hand's end of the link: whom it believes, when it challenges, and when it may send.
//
// It challenges after its own start and after kOutage_ms without a frame, until a frame answers; a nonce is
// good for kNonce_ms at most, and another is drawn where it might end before the answer. A frame that is kLate_ms
// later than the session's quickest, or as old as kHeldBack of its glove's frames take, is followed by a new
// challenge: who holds frames back and hands them on slowly has no more of them. The radio carries one
// direction at a time: this end sends after a frame that states that its sender listens, or when nothing has
// come for kSilence_ms. Challenges do not wait for that: what they could spoil would not be believed. They begin
// in any gap, except while a turn is waited for: a glove that receives its beginning leaves out its frame. And they begin at no even
// distance: two boards that begin at once would else do so for ever.
#pragma once

#include "runtime/link/latency.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor {
namespace link {

constexpr uint16_t kOutage_ms = 500;
constexpr uint8_t kHeldBack = 126;  // frames; the next and the one that shows it are believed, too: 128
constexpr uint16_t kGreatestDelay_ms = 750;  // of the radio, one way, jitter included
// At this distance of frames: a session's first is two ways old, one that is late a way more, and it may be kHeldBack old.
constexpr uint16_t greatest_delay_ms(double period_ms) {
  return kHeldBack * period_ms / 3 < kGreatestDelay_ms ? static_cast<uint16_t>(kHeldBack * period_ms / 3)
                                                       : kGreatestDelay_ms;
}
// A challenge, its answer, and what the slowest glove waits for a slot.
constexpr uint16_t kNonce_ms = 2 * kGreatestDelay_ms + 500;
constexpr uint16_t kFirst_ms = 150;  // of a nonce: two challenges in gaps, which slow gloves receive
constexpr uint16_t kTurns_ms = 600;  // from a turn to the next, and some more
constexpr uint16_t kInVain_ms = 1000;
constexpr uint16_t kLate_ms = 1000;
constexpr uint8_t kStirred = 48;     // readings in the pool before the first nonce is drawn
constexpr uint16_t kAnswer_ms = 90;  // from a challenge after a frame: the answer has begun by then
constexpr uint16_t kTurnAgain_ms =
    40;  // from a challenge to one in a turn: what it may have cut short is over
constexpr uint16_t kChallenge_ms = 200;  // from a challenge in a silence: longer than the slowest glove takes
constexpr uint8_t kScatter_ms = 64;      // and up to so many more; a power of two
constexpr uint8_t kGap_ms = 5;           // without a byte: a frame has ended, and none has begun
constexpr uint8_t kGapEnd_ms = 15;       // the next may begin before one of ours arrives
constexpr uint16_t kTelemetry_ms = 450;  // less than from turn to turn
constexpr uint16_t kSilence_ms = 300;
constexpr uint8_t kTurn_ms = 5;  // after a frame's end: later, the sender may no longer listen
// Telemetries in succession that each cost a frame: a radio that delays brings the turn when the next frame is on the air.
// The hand then waits for a part of the period in it: 0, 1/2, 1/4, 3/4, by turns.
constexpr uint8_t kCostly = 5;

class HandEnd {
 public:
  explicit HandEnd(const Key* pair) : receiver_(pair) {}

  // `starts`: a count that lasts, of this board.
  void start(uint32_t starts) { nonces_.start(starts); }

  void stir(uint16_t noise) {
    nonces_.stir(noise);
    if (stirred_ < kStirred && ++stirred_ == kStirred) renew();
  }
  uint32_t starts() const { return nonces_.starts(); }

  // Once a millisecond.
  void tick() {
    age(since_frame_ms_);
    age(since_byte_ms_);
    age(since_challenge_ms_);
    age(since_telemetry_ms_);
    age(nonce_ms_);
    ++now_ms_;
    if (turn_ms_ > 0) --turn_ms_;
    // A session that took long to come about is given up later: the next one takes as long.
    const bool out = since_frame_ms_ > kOutage_ms + first_age_ms_ / 8;
    // The answer to a challenge that this nonce's end cut off would cost the glove's next turn.
    const bool spent = nonce_ms_ >= kNonce_ms || (nonce_ms_ >= kNonce_ms - kChallenge_ms && may_challenge());
    if (receiver_.answered() ? out : seeks() && spent) renew();
    if (out) latency_.restart();
  }

  // As Receiver::push, with verify() after `pending`.
  Received push(uint8_t byte) {
    since_byte_ms_ = 0;
    const Received result = receiver_.push(byte);
    const bool whole =
        result == Received::pending || result == Received::other || result == Received::not_trusted;
    // In a session only a frame that is believed gives the turn: anybody can claim to listen.
    if (whole && !in_touch()) take_turn();
    return result;
  }
  Received verify() {
    const bool first = !in_touch();
    const Moment before = moment();
    const Received result = receiver_.verify();
    if (result != Received::frame) return result;
    since_frame_ms_ = 0;
    take_turn();
    const uint16_t frames = static_cast<uint16_t>(moment().sequence - before.sequence);
    if (frames > 1 && !first) costly_ |= 1;
    keep_time(first, frames, static_cast<uint16_t>(moment().time_ms - before.time_ms));
    if (is_old(latency_.add(now_ms_, receiver_.frame().time_ms)) && receiver_.pair() != nullptr) renew();
    return result;
  }

  enum class Message : uint8_t { none, challenge, telemetry };

  // What is to be sent now, if anything.
  Message due() const {
    if (seeks()) return may_challenge() ? Message::challenge : Message::none;
    const bool turn = turn_ms_ > 0 && turn_ms_ <= kTurn_ms;
    if (!turn && since_byte_ms_ < kSilence_ms) return Message::none;
    return since_telemetry_ms_ >= kTelemetry_ms ? Message::telemetry : Message::none;
  }

  // To wire, which has room for kMaxWire; returns the bytes written. One SipHash. It begins with a delimiter: what a
  // collision left of the challenge before would else spoil this one, too.
  uint8_t challenge(uint8_t* wire) {
    since_challenge_ms_ = 0;
    scatter_ms_ = nonces_.noise() & (kScatter_ms - 1 - (scatter_ms_ & 1));  // no two odd ones in succession
    turn_ms_ = 0;
    Packet packet;
    __builtin_memcpy(packet.body(), receiver_.session().nonce().bytes, kNonceBytes);
    wire[0] = kDelimiter;
    return static_cast<uint8_t>(
        1 + packet.seal({Type::challenge, false, false, 0}, kNonceBytes, receiver_.pair(), wire + 1));
  }
  // Telemetry or state: `packet` has the body already. Nobody moves by it: not guarded, so that a tick does not wait
  // for a tag.
  uint8_t seal(Type type, Packet& packet, uint8_t body_bytes, uint8_t* wire) {
    since_telemetry_ms_ = 0;
    turn_ms_ = 0;
    costly_ = (costly_ & 1) != 0 ? costly_ + 1 : 0;
    if (costly_ == 2 * kCostly) {
      costly_ = 0;
      const uint8_t half = period_ms_ / 2;
      wait_ms_ = wait_ms_ < half ? wait_ms_ + half : wait_ms_ == half ? half / 2 : 0;
    }
    return packet.seal({type, false, false, sequence_++}, body_bytes, nullptr, wire);
  }

  uint16_t now_ms() const { return now_ms_; }  // since this end began to count, wraps
  bool in_touch() const { return receiver_.answered(); }
  const Receiver& receiver() const { return receiver_; }

 private:
  // Of the frame that was believed last, by the glove.
  struct Moment {
    uint16_t sequence;
    uint16_t time_ms;
  };
  Moment moment() const {
    return {static_cast<uint16_t>(receiver_.frame().counter), receiver_.frame().time_ms};
  }
  static void age(uint16_t& time_ms) {
    if (time_ms < UINT16_MAX) ++time_ms;
  }
  // Of the frame that has come: the session's first is as old as its nonce at most, each other by
  // `late_ms` more, and
  //   period = min_k floor((t_k - t_{k-1}) / (n_k - n_{k-1}))
  // by the glove's clock and counter: what it leaves out, or what gets lost, makes no difference as soon as two have come
  // that follow each other.
  bool is_old(uint16_t late_ms) const {
    return late_ms > kLate_ms || first_age_ms_ + late_ms > static_cast<uint16_t>(kHeldBack * period_ms_);
  }
  void keep_time(bool first, uint16_t frames, uint16_t ms) {
    if (first) {
      first_age_ms_ = nonce_ms_;
      period_ms_ = UINT8_MAX;
    } else if (frames > 0) {
      if (frames > 1) ms = static_cast<uint16_t>(ms / frames);  // a microcontroller divides slowly
      if (ms < period_ms_) period_ms_ = static_cast<uint8_t>(ms);
    }
  }
  void take_turn() {
    if (receiver_.packet().listens()) turn_ms_ = static_cast<uint8_t>(kTurn_ms + wait_ms_);
  }
  bool seeks() const { return receiver_.pair() != nullptr && !receiver_.answered() && stirred_ == kStirred; }
  bool may_challenge() const {
    // Between two frames a challenge may meet the next, which may be the one that gives the turn. A glove gives it twice a
    // second: where a first attempt was in vain, no gap is taken for so long.
    const bool awaits_turn = static_cast<uint16_t>(nonce_ms_ - kFirst_ms) < kTurns_ms;
    const uint16_t quiet_ms = awaits_turn ? kAnswer_ms : kGap_ms;
    // A turn is never in the glove's way, except over a radio that delays, where each may be: once a nonce has long been in
    // vain some challenges, drawn, no two in succession, go by no frame.
    if (nonce_ms_ < kInVain_ms || (scatter_ms_ & 1) == 0) {
      if (turn_ms_ > 0) return since_challenge_ms_ >= kTurnAgain_ms;
      if (since_byte_ms_ >= quiet_ms && since_byte_ms_ < kGapEnd_ms)
        return since_challenge_ms_ >= kAnswer_ms + scatter_ms_;
    }
    return since_byte_ms_ >= quiet_ms && since_challenge_ms_ >= kChallenge_ms + scatter_ms_;
  }
  void renew() {
    receiver_.challenge(nonces_.next());
    latency_.restart();
    nonce_ms_ = 0;
  }

  Receiver receiver_;  // first, where a debugger finds its statistics
  Latency latency_;
  NonceSource nonces_;
  uint8_t stirred_ = 0;
  uint16_t now_ms_ = 0;
  uint16_t sequence_ = 0;
  uint16_t since_frame_ms_ = 0;
  uint16_t since_byte_ms_ = 0;
  uint16_t since_challenge_ms_ = kChallenge_ms;
  uint8_t scatter_ms_ = 0;
  uint16_t since_telemetry_ms_ = 0;
  uint16_t nonce_ms_ = 0;
  uint16_t first_age_ms_ = 0;  // of the session's first frame, at most
  uint8_t period_ms_ = 0;      // of the session's frames
  uint8_t turn_ms_ = 0;
  uint8_t wait_ms_ = 0;  // in its turn, before telemetry
  uint8_t costly_ = 0;  // twice as many telemetries in succession; odd: and a frame was missed since the last
};

}  // namespace link
}  // namespace flexor
