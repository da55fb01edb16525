// A motor's model beside its potentiometer: what the duty must have done, and what the reading says, each tick.
//
// In units of duty, speed as the duty that would hold it against no friction (v), u the duty of the last tick:
//   v* = v + (u -+ |u|/4 -+ load - v) rate,   v = sign(v*) max(|v*| - friction rate, 0)
// once with the load against the motor (slow) and once with it (fast): the least and the greatest speed that the
// motor can have. Two sums of what they and the reading disagree about, never below zero, so that an honest
// finger's stay near it for ever (Page, Biometrika 41, 1954):
//   behind = max(behind + slow - moved - forget, 0),   ahead = max(ahead + moved - fast - forget, 0)
// Nothing here knows an angle from the duty alone: the model only says how far the finger must have moved, and
// how far it can have, since both last agreed.
#pragma once

#include "runtime/core/fixed_point.hpp"
#include "runtime/hand/fault.hpp"

namespace flexor {
namespace hand {

// Duties are 2^-13 of the supply here: differences of two fit 16 bits.
constexpr int kWatchShift = 2;
constexpr int kFine = 2;              // bits of smoothed readings beyond Q4
constexpr int16_t kJump = 24;         // Q4: further than any finger moves in a tick, noise included
constexpr int16_t kRough = 64;        // Q4: jumps beyond kJump, summed; a tick forgives one
constexpr int16_t kStillTravel = 12;  // Q4: less is standing still
constexpr uint8_t kStill_ticks = 12;

struct MotorSettings {
  uint16_t rate;        // h / (tau + h), Q16; 0: nothing is known of the motor, and nothing watched
  int16_t friction;     // dry, 2^-13 duty in a tick: friction's duty times rate
  int16_t load;         // greatest, 2^-13 duty
  int16_t duty_per_q6;  // that holds a 64th of a degree a tick, 2^-13 duty
  int16_t forget;       // of a disagreement, in a tick; 2^-13 duty ticks
  int32_t gap;          // disagreement that is a fault, 2^-13 duty ticks
  int16_t breakaway;    // a finger that stands still with so much duty gets `kick` instead
  int16_t kick;         // duty that moves it against friction and load
};

enum class Verdict : uint8_t { good, behind, ahead, jumped };

class MotorWatch {
 public:
  void start(int16_t measured) {
    slow_ = fast_ = 0;
    behind_ = ahead_ = 0;
    last_ = measured;
    smooth_ = still_at_ = since_behind_ = since_ahead_ = static_cast<int16_t>(measured << kFine);
    still_ticks_ = 0;
    rough_ = 0;
  }

  // The duty of the last tick, and the reading that it led to.
  Verdict tick(const MotorSettings& c, int16_t duty, int16_t measured) {
    const int16_t moved = static_cast<int16_t>(measured - last_);
    last_ = measured;
    if (jumps(moved)) return Verdict::jumped;
    const int16_t u = static_cast<int16_t>(duty >> kWatchShift);
    const int16_t apart = static_cast<int16_t>(((u < 0 ? -u : u) >> 2) + c.load);
    slow_ = next(c, slow_, static_cast<int16_t>(u - apart));
    fast_ = next(c, fast_, static_cast<int16_t>(u + apart));
    const int16_t before = smooth_;
    smooth_ = static_cast<int16_t>(smooth_ + ((static_cast<int16_t>(measured << kFine) - smooth_) >> 1));
    const int32_t travel = static_cast<int32_t>(smooth_ - before) * c.duty_per_q6;
    behind_ = kept(behind_ + slow_ - travel - c.forget, since_behind_);
    ahead_ = kept(ahead_ + travel - fast_ - c.forget, since_ahead_);
    watch_standing();
    if (behind_ > c.gap) return Verdict::behind;
    return ahead_ > c.gap ? Verdict::ahead : Verdict::good;
  }

  // While the motor is off, readings only: no jumps, and none for a while.
  bool calm(int16_t measured) {
    const int16_t before = rough_;
    const int16_t moved = static_cast<int16_t>(measured - last_);
    last_ = measured;
    (void)jumps(moved);
    again_ = rough_ > before;
    return rough_ == 0;
  }
  bool jumped_again() const { return again_; }

  bool still() const { return still_ticks_ >= kStill_ticks; }
  // How far the finger would go on without duty, Q4: by the model, as long as it moves at all.
  int16_t coast() const { return still() ? 0 : static_cast<int16_t>((slow_ + fast_) >> 7); }
  // How far the reading has come since the model and it last agreed, Q4.
  int16_t travel(Verdict verdict) const {
    return static_cast<int16_t>((smooth_ - (verdict == Verdict::behind ? since_behind_ : since_ahead_)) >>
                                kFine);
  }

 private:
  FLEXOR_SHARED static int16_t next(const MotorSettings& c, int16_t speed, int16_t target) {
    const int32_t change = static_cast<int32_t>(static_cast<int16_t>(target - speed)) * c.rate;
    const int16_t pushed = static_cast<int16_t>(speed + static_cast<int16_t>(change >> 16));
    return static_cast<int16_t>(pushed - core::clamp(pushed, static_cast<int16_t>(-c.friction), c.friction));
  }

  FLEXOR_SHARED bool jumps(int16_t moved) {
    const int16_t far = static_cast<int16_t>((moved < 0 ? -moved : moved) - kJump);
    rough_ = static_cast<int16_t>(far > 0 ? core::clamp<int16_t>(rough_ + far, 0, 2 * kRough)
                                          : rough_ - (rough_ > 0));
    return rough_ > kRough;
  }

  int32_t kept(int32_t sum, int16_t& since) const {
    if (sum > 0) return sum;
    since = smooth_;
    return 0;
  }

  void watch_standing() {
    const int16_t moved = static_cast<int16_t>((smooth_ - still_at_) >> kFine);
    if (moved > kStillTravel || moved < -kStillTravel) {
      still_at_ = smooth_;
      still_ticks_ = 0;
      return;
    }
    if (still_ticks_ < kStill_ticks) ++still_ticks_;
  }

  int32_t behind_ = 0;
  int32_t ahead_ = 0;
  int16_t slow_ = 0;
  int16_t fast_ = 0;
  int16_t last_ = 0;
  int16_t smooth_ = 0;  // Q6: half of what a reading's noise is
  int16_t since_behind_ = 0;
  int16_t since_ahead_ = 0;
  int16_t still_at_ = 0;
  int16_t rough_ = 0;
  uint8_t still_ticks_ = 0;
  bool again_ = false;
};

// An input that hangs in the air keeps the charge of the one that was read before it: two neighbours that are
// equal to a count while they move. Which of both hangs cannot be told, nor need it: with the second finger
// limp, either its reading follows the first's all the same, or the first's stands still against its duty.
class NeighbourWatch {
 public:
  // Readings of the pair, a tick. True: one of them may be the other's shadow.
  bool tick(uint16_t a, uint16_t b) {
    const int16_t apart = static_cast<int16_t>(a - b);
    if (apart > 1 || apart < -1) {
      ticks_ = 0;
      shadow_ = false;
      return false;
    }
    if (ticks_ == 0) from_ = a;
    if (ticks_ < kTicks) ++ticks_;
    const int16_t moved = static_cast<int16_t>(a - from_);
    if (ticks_ == kTicks && (moved > kMoved || moved < -kMoved)) shadow_ = true;
    return shadow_;
  }

 private:
  static constexpr uint8_t kTicks = 100;
  static constexpr int16_t kMoved = 5;  // counts, a bit more than a degree
  uint16_t from_ = 0;
  uint8_t ticks_ = 0;
  bool shadow_ = false;
};

}  // namespace hand
}  // namespace flexor
