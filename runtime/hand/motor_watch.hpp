// A motor's model beside its potentiometer: what the duty can have done, and what the reading says, each turn of
// kTurn_ticks.
//
// v is how fast the last duty u would make a finger go that nothing holds back, in a turn:
//   v = v + (gain u - rate v) 2^-16,   width = |v|/4 + load
// Friction and load leave of it something between low = held(v - width) and high = held(v + width), where
// held(x) = sign(x) max(|x| - friction, 0). Two sums of what the reading has moved beyond that, never below zero,
// so that an honest finger's stay near it for ever (Page, Biometrika 41, 1954):
//   ahead = max(ahead + moved - high - forget, 0),   behind = max(behind + low - moved - forget, 0)
// With a duty that only just moves a finger against friction and load, low says nothing for long. There the effort
// is counted: turns of such a duty, until the reading has gone along with it.
#pragma once

#include "runtime/core/fixed_point.hpp"
#include "runtime/hand/fault.hpp"

namespace flexor {
namespace hand {

constexpr int kTurn_ticks = 2;      // of the model; readings are looked at in every tick
constexpr int kFine = 2;            // bits of smoothed readings beyond Q4
constexpr int kSpeedFraction = 13;  // v: degrees in a turn
constexpr int kSumFraction = 11;    // sums, load, friction: +-16 degrees
constexpr int16_t kJump = 24;       // Q4: further than any finger moves in a tick, noise included
constexpr int16_t kRough = 64;      // Q4: jumps beyond kJump, summed; a tick forgives one
constexpr int16_t kProgress = 64;   // Q6: less is standing still
constexpr uint8_t kPatience_turns = 2;
constexpr uint8_t kEffort_turns = 11;

struct MotorSettings {
  int16_t rate;       // 1 - exp(-turn / tau), Q16; 0: nothing is known of the motor, and nothing watched
  int16_t gain;       // rate times the full speed, Q14 degrees in a turn
  int16_t friction;   // dry: speed that it takes, Q11 degrees in a turn
  int16_t load;       // the greatest: likewise
  int16_t forget;     // of a disagreement, in a turn; likewise
  int16_t gap;        // disagreement that is a fault, Q11 degrees
  int16_t breakaway;  // a finger that stands still with so much duty gets `kick` instead
  int16_t kick;       // duty that moves it against friction and load
};

enum class Verdict : uint8_t {
  good,
  jumped,
  stalled,  // the motor must have moved it, and the reading stands still
  against,  // the reading moves against the motor
  without,  // the reading moves without the motor
};

class MotorWatch {
 public:
  void start(int16_t measured) {
    other_duty_ = speed_ = ahead_ = behind_ = rough_ = 0;
    last_ = measured;
    smooth_ = before_ = from_ = since_behind_ = since_ahead_ = static_cast<int16_t>(measured << kFine);
    effort_ = 0;
  }

  // The duty of the last tick, and the reading that it led to. `turn`: every second tick.
  Verdict tick(const MotorSettings& c, bool turn, int16_t duty, int16_t measured) {
    const int16_t stepped = static_cast<int16_t>(measured - last_);
    last_ = measured;
    if (jumps(stepped)) return Verdict::jumped;
    smooth_ = static_cast<int16_t>(smooth_ + ((static_cast<int16_t>(measured << kFine) - smooth_) >> 1));
    if (turn) return judge(c, duty);
    other_duty_ = duty;
    return Verdict::good;
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

  // It ought to move, and has not for a while.
  bool held() const { return effort_ >= kPatience_turns; }
  // How far the finger would go on without duty, Q4: by the model, a 64th of a second of its speed.
  int16_t coast(const MotorSettings& c) const {
    return effort_ > 0 ? 0
                       : static_cast<int16_t>(
                             slowed(c, static_cast<int16_t>(speed_ >> (kSpeedFraction - kSumFraction))) >> 4);
  }

 private:
  Verdict judge(const MotorSettings& c, int16_t duty) {
    const int16_t mean = static_cast<int16_t>((duty >> 1) + (other_duty_ >> 1));
    speed_ = static_cast<int16_t>(speed_ + core::upper_half(static_cast<int32_t>(c.gain) * mean -
                                                            static_cast<int32_t>(c.rate) * speed_));
    compare(c, static_cast<int16_t>((smooth_ - before_) * (1 << (kSumFraction - 6))));
    before_ = smooth_;
    count_effort(c, duty);
    if (behind_ > c.gap) return blame(duty > 0, static_cast<int16_t>(since_behind_ - smooth_));
    if (ahead_ > c.gap) return blame(duty < 0, static_cast<int16_t>(smooth_ - since_ahead_));
    return effort_ >= kEffort_turns ? Verdict::stalled : Verdict::good;
  }

  // What friction leaves of a speed.
  static int16_t slowed(const MotorSettings& c, int16_t speed) {
    return static_cast<int16_t>(speed - core::clamp(speed, static_cast<int16_t>(-c.friction), c.friction));
  }

  FLEXOR_SHARED bool jumps(int16_t moved) {
    const int16_t far = static_cast<int16_t>((moved < 0 ? -moved : moved) - kJump);
    rough_ = static_cast<int16_t>(far > 0 ? core::clamp<int16_t>(rough_ + far, 0, 2 * kRough)
                                          : rough_ - (rough_ > 0));
    return rough_ > kRough;
  }

  void compare(const MotorSettings& c, int16_t moved) {
    const int16_t v = static_cast<int16_t>(speed_ >> (kSpeedFraction - kSumFraction));
    const int16_t width = static_cast<int16_t>(((v < 0 ? -v : v) >> 2) + c.load);
    const int16_t high = slowed(c, static_cast<int16_t>(v + width));
    const int16_t low = slowed(c, static_cast<int16_t>(v - width));
    ahead_ = kept(static_cast<int16_t>(ahead_ + moved - high - c.forget), since_ahead_);
    behind_ = kept(static_cast<int16_t>(behind_ + low - moved - c.forget), since_behind_);
  }
  int16_t kept(int16_t sum, int16_t& since) const {
    if (sum > 0) return sum;
    since = smooth_;
    return 0;
  }

  // `away`: how far the reading has moved away from the model since they agreed. `driven`: against the duty.
  static Verdict blame(bool driven, int16_t away) {
    if (away <= kProgress) return Verdict::stalled;
    return driven ? Verdict::against : Verdict::without;
  }

  // A finger that is still carried the other way is being slowed down: no effort yet. One that a stop throws back
  // has to come further than it was.
  void count_effort(const MotorSettings& c, int16_t duty) {
    const bool up = duty > 0;
    if ((up ? duty : -duty) <= c.breakaway || up != (speed_ > 0)) {
      if (effort_ > 0) --effort_;
      return;
    }
    if (up != upwards_) effort_ = 0;
    upwards_ = up;
    if (effort_ == 0) from_ = smooth_;
    const int16_t moved = static_cast<int16_t>(smooth_ - from_);
    const bool along = up ? moved > kProgress : moved < -kProgress;
    effort_ = along ? 0 : static_cast<uint8_t>(effort_ + 1);
  }

  int16_t other_duty_ = 0;  // of the tick between two turns
  int16_t speed_ = 0;
  int16_t ahead_ = 0;
  int16_t behind_ = 0;
  int16_t since_ahead_ = 0;
  int16_t since_behind_ = 0;
  int16_t last_ = 0;
  int16_t smooth_ = 0;  // Q6: half of what a reading's noise is
  int16_t before_ = 0;  // a turn ago
  int16_t from_ = 0;    // where the way along with the duty began
  int16_t rough_ = 0;
  uint8_t effort_ = 0;
  bool upwards_ = false;
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
