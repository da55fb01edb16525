// Grab, pinch and trigger from flexion, with hysteresis.
//
//   grab:    mean of index, middle, ring and pinky        pinch: mean of thumb and index        trigger: index
// on from 9/16 of the range, off below 7/16, and as it was in between: LucidGloves switches at 1/2, where a finger that is
// held there chatters. The trigger's pull goes from 0 at half of the range to all of it at a bent finger.
#pragma once

#include "runtime/link/opengloves.hpp"

namespace flexor {
namespace link {

constexpr uint16_t kGestureOn = 576;
constexpr uint16_t kGestureOff = 448;

class Gestures {
 public:
  // Flexion 0 .. kGloveTop of five fingers -> glove_button::kGrab, kPinch, kTrigger. fingers: a bit for each that the glove
  // has, thumb first. Without its fingers a gesture is never made: pinch needs both, grab one of the four.
  uint8_t step(const uint16_t* flexion, uint8_t fingers = 0x1f) {
    uint16_t grab = 0;
    uint8_t grabbing = 0;
    for (uint8_t i = 1; i < kGloveFingers; ++i) {
      if ((fingers >> i & 1) == 0) continue;
      grab = static_cast<uint16_t>(grab + flexion[i]);
      ++grabbing;
    }
    if (grabbing > 0) update(glove_button::kGrab, static_cast<uint16_t>(grab / grabbing));
    if ((fingers & 3) == 3)
      update(glove_button::kPinch, static_cast<uint16_t>((flexion[0] + flexion[1]) / 2));
    if ((fingers & 2) != 0) update(glove_button::kTrigger, flexion[1]);
    return made_;
  }

 private:
  void update(uint8_t gesture, uint16_t flexion) {
    if (flexion >= kGestureOn) made_ = static_cast<uint8_t>(made_ | gesture);
    if (flexion < kGestureOff) made_ = static_cast<uint8_t>(made_ & ~gesture);
  }

  uint8_t made_ = 0;
};

// The trigger's pull, 0 .. kGloveTop.
inline uint16_t trigger_pull(uint16_t index_flexion) {
  if (index_flexion <= kGloveTop / 2) return 0;
  return static_cast<uint16_t>(2 * (index_flexion - kGloveTop / 2) - 1);
}

}  // namespace link
}  // namespace flexor
