// Readings of a strip that is worn, and then anything at all: the same on a board and on a PC.
#pragma once

#include <stdint.h>

namespace flexor {
namespace cosim {

// 1600 samples: bends, each other one whole and a twelfth farther than the model knows, with noise and a drift; then 400 of any int16.
class TrackerExercise {
 public:
  static constexpr uint16_t kSamples = 2000;

  int16_t next() {
    random_ = static_cast<uint16_t>(random_ * 25173u + 13849u);
    if (++sample_ > 1600) return static_cast<int16_t>(random_);
    const uint8_t phase = static_cast<uint8_t>(sample_ & 63);
    const int16_t depth = (sample_ & 64) != 0 ? 360 : 160;
    const int16_t closed = phase < 8 ? phase : phase < 32 ? 8 : phase < 40 ? 40 - phase : 0;
    return static_cast<int16_t>(1200 + closed * depth + (sample_ >> 3) + ((random_ >> 8) & 31));
  }

 private:
  uint16_t random_ = 1;
  uint16_t sample_ = 0;
};

}  // namespace cosim
}  // namespace flexor
