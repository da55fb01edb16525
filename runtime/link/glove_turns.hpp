// When a glove sends: the radio carries one direction at a time.
//
// After each `every`th frame the glove is silent for `slots` more, and the hand may send; after each `seek_every`th
// while it is not received. A frame whose slot comes while somebody else is sending is left out, too, holds() of them
// in succession at most, and between() are not before the next: a hand that has lost touch sends in any gap, and no
// rubbish silences this end, nor parts its frames by more than the hand bridges.
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

struct Turns {
  uint8_t every;
  uint8_t seek_every;
  uint8_t slots;
};

class GloveTurns {
 public:
  explicit GloveTurns(const Turns& turns)
      : turns_(turns), since_listening_(static_cast<uint8_t>(turns.seek_every - 1)) {}

  // A byte came.
  void byte() { receives_ = true; }
  // A whole frame of somebody came.
  void received() { received_ = static_cast<uint8_t>(2 * turns_.every); }
  // For so many slots the other end gets its turn after each frame.
  void favour(uint8_t slots) { favoured_ = slots; }

  // A slot for a frame has come: whether it is this end's. `amid`: a frame has begun to come, and not ended.
  bool take_slot(bool amid) {
    const bool receives = receives_ && amid;
    receives_ = false;
    if (silent_ > 0) {
      --silent_;
      return false;
    }
    if (receives && held_ < holds()) {
      ++held_;
      taken_ = 0;
      return false;
    }
    if (++taken_ >= between()) held_ = taken_ = 0;
    return true;
  }

  // For the frame of this slot: whether it states that its sender listens after it. `now`: it shall.
  bool listens(bool now) {
    if (received_ > 0) --received_;
    const bool favoured = favoured_ > 0;
    if (favoured) --favoured_;
    const uint8_t every = received_ > 0 ? turns_.every : turns_.seek_every;
    if (++since_listening_ < every && !now && !favoured) return false;
    since_listening_ = 0;
    silent_ = turns_.slots;
    return true;
  }

 private:
  // A slot is shorter than 70 ms, and than a frame of the hand: two make what is left of a frame that was cut off, and a
  // whole one.
  bool is_fast() const { return turns_.seek_every > 1; }
  uint8_t holds() const { return is_fast() ? 2 : 1; }
  uint8_t between() const { return is_fast() ? 1 : 2; }

  Turns turns_;
  uint8_t since_listening_;  // frames
  uint8_t received_ = 0;     // frames for which the other end counts as received
  uint8_t silent_ = 0;       // slots
  uint8_t favoured_ = 0;     // slots
  uint8_t held_ = 0;         // slots left to who sent
  uint8_t taken_ = 0;        // slots since
  bool receives_ = false;    // since the last slot
};

}  // namespace link
}  // namespace flexor
