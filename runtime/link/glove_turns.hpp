// When a glove speaks: the radio carries one direction at a time.
//
// After each kEvery'th frame the glove is silent for kSlots more, and the hand may speak; after each kSeekEvery'th
// while it is not heard. A frame whose slot comes while somebody else is speaking is left out, too, kHolds of them in
// succession at most, and kBetween are not before the next: a hand that has lost touch speaks wherever it hears a gap, and no
// rubbish silences this end, nor parts its frames by more than the hand bridges.
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

template <uint8_t kEvery, uint8_t kSeekEvery, uint8_t kSlots>
class GloveTurns {
 public:
  // A byte came.
  void byte() { hears_ = true; }
  // A whole frame of somebody came.
  void heard() { heard_ = 2 * kEvery; }
  // For so many slots the other end gets its turn after each frame.
  void favour(uint8_t slots) { favoured_ = slots; }

  // A slot for a frame has come: whether it is this end's. `amid`: a frame has begun to come, and not ended.
  bool take_slot(bool amid) {
    const bool hears = hears_ && amid;
    hears_ = false;
    if (silent_ > 0) {
      --silent_;
      return false;
    }
    if (hears && held_ < kHolds) {
      ++held_;
      taken_ = 0;
      return false;
    }
    if (++taken_ >= kBetween) held_ = taken_ = 0;
    return true;
  }

  // For the frame of this slot: whether it says that its sender listens after it. `now`: it shall.
  bool listens(bool now) {
    if (heard_ > 0) --heard_;
    const bool favoured = favoured_ > 0;
    if (favoured) --favoured_;
    const uint8_t every = heard_ > 0 ? kEvery : kSeekEvery;
    if (++since_listening_ < every && !now && !favoured) return false;
    since_listening_ = 0;
    silent_ = kSlots;
    return true;
  }

 private:
  static constexpr bool kFast = kSeekEvery > 1;  // a slot is shorter than 70 ms, and than a frame of the hand
  static constexpr uint8_t kHolds =
      kFast ? 2 : 1;  // slots: what is left of a frame that was cut off, and a whole one
  static constexpr uint8_t kBetween = kFast ? 1 : 2;  // slots

  uint8_t since_listening_ = kSeekEvery - 1;  // frames
  uint8_t heard_ = 0;                         // frames for which the other end counts as heard
  uint8_t silent_ = 0;                        // slots
  uint8_t favoured_ = 0;                      // slots
  uint8_t held_ = 0;                          // slots left to who spoke
  uint8_t taken_ = 0;                         // slots since
  bool hears_ = false;                        // since the last slot
};

}  // namespace link
}  // namespace flexor
