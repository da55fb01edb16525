// Zero without a computer: an open hand for two seconds, a fist for two seconds, and each sensor reads again what
// the model was made with.
//
//   corrected = gain alpha + offset,   gain = (F - O) / (f - o),   offset = O - gain o
// O, F: what the model's sensor read at open hand and fist; o, f: what it reads now, means over the hold. It is
// refused, with the old correction kept, when a sensor's poses are nearer than half or farther than twice of
// what they were, or the hand did not hold still.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace sensor {

// A sensor's reading in the two poses, Q5; equal: the model has none.
struct Poses {
  int16_t open;
  int16_t fist;
};

struct Correction {
  int16_t gain;    // Q14
  int16_t offset;  // Q5

  int16_t operator()(int16_t alpha) const {
    const int32_t scaled = (static_cast<int32_t>(alpha) * gain + (1 << 13)) >> 14;
    return static_cast<int16_t>(core::clamp<int32_t>(scaled + offset, INT16_MIN, INT16_MAX));
  }
};

constexpr Correction kUncorrected = {1 << 14, 0};

enum class ZeroStage : uint8_t {
  idle,
  open,     // open the hand, and hold it
  fist,     // close it, and hold it
  done,     // corrections() are new
  refused,  // poses too near to each other, too far apart, or not held
};

template <uint8_t kSensors>
class Zero {
 public:
  // `rate_hz` of step().
  explicit Zero(uint8_t rate_hz) : second_(rate_hz) {}

  // The button: begins, or gives up what has begun.
  void press() {
    enter(stage_ == ZeroStage::open || stage_ == ZeroStage::fist ? ZeroStage::idle : ZeroStage::open);
  }

  // One sample of all sensors, before correction. `settings`: what the model has of each, its `poses` above all; a sensor
  // whose poses are equal is left alone.
  template <class Settings>
  ZeroStage step(const Settings* settings, const int16_t* alpha) {
    if (stage_ != ZeroStage::open && stage_ != ZeroStage::fist) return stage_;
    if (++samples_ <= kSettle_s * second_) return stage_;
    for (uint8_t i = 0; i < kSensors; ++i) hold_[i].add(alpha[i]);
    if (samples_ < (kSettle_s + kHold_s) * second_) return stage_;
    const int16_t held = static_cast<int16_t>(kHold_s * second_);
    for (uint8_t i = 0; i < kSensors; ++i) {
      const Poses& poses = settings[i].poses;
      if (poses.open == poses.fist) continue;
      if (!hold_[i].still(poses)) return enter(ZeroStage::refused);
      const int16_t mean = static_cast<int16_t>(hold_[i].sum / held);
      if (stage_ == ZeroStage::open) open_[i] = mean;
      if (stage_ == ZeroStage::fist && !correct(i, poses, mean)) return enter(ZeroStage::refused);
    }
    return enter(stage_ == ZeroStage::open ? ZeroStage::fist : ZeroStage::done);
  }

  ZeroStage stage() const { return stage_; }
  const Correction* corrections() const { return correction_; }

 private:
  static constexpr uint8_t kSettle_s = 1;  // to take the pose
  static constexpr uint8_t kHold_s = 2;
  static constexpr uint8_t kStillness = 8;  // the range of a hold: at most this part of the poses' distance

  struct Hold {
    int32_t sum;
    int16_t least;
    int16_t most;

    void add(int16_t alpha) {
      sum += alpha;
      least = alpha < least ? alpha : least;
      most = alpha > most ? alpha : most;
    }
    bool still(const Poses& poses) const {
      const int32_t apart = static_cast<int32_t>(poses.fist) - poses.open;
      const int32_t range = static_cast<int32_t>(most) - least;
      return range * kStillness <= (apart < 0 ? -apart : apart);
    }
  };

  ZeroStage enter(ZeroStage stage) {
    samples_ = 0;
    for (Hold& hold : hold_) hold = {0, INT16_MAX, INT16_MIN};
    return stage_ = stage;
  }

  bool correct(uint8_t sensor, const Poses& poses, int16_t fist) {
    int32_t wanted = static_cast<int32_t>(poses.fist) - poses.open;
    int32_t seen = static_cast<int32_t>(fist) - open_[sensor];
    if (wanted < 0) {
      wanted = -wanted;
      seen = -seen;
    }
    if (2 * seen <= wanted || seen > 2 * wanted) return false;
    correction_[sensor].gain = static_cast<int16_t>((wanted << 14) / seen);
    correction_[sensor].offset = 0;
    const int32_t offset = static_cast<int32_t>(poses.open) - correction_[sensor](open_[sensor]);
    correction_[sensor].offset = static_cast<int16_t>(core::clamp<int32_t>(offset, INT16_MIN, INT16_MAX));
    return true;
  }

  uint8_t second_;
  ZeroStage stage_ = ZeroStage::idle;
  uint16_t samples_ = 0;
  Hold hold_[kSensors] = {};
  int16_t open_[kSensors] = {};
  Correction correction_[kSensors] = {};
};

}  // namespace sensor
}  // namespace flexor
