// A motor's model beside its potentiometer: what the duty can have done, and what the reading shows, each turn of
// kTurn_ticks.
//
// v is how fast the last duty u would make a finger go that nothing holds back, in a turn:
//   v = v + (gain u - rate v) 2^-16
// Friction and load leave of it, where v > 0, something between low = held(7/8 v - load) and high = held(19/16 v + load),
// held(x) = sign(x) max(|x| - friction, 0). Two sums of what the reading has moved beyond that, never below zero,
// so that an honest finger's stay near it for ever (Page, Biometrika 41, 1954):
//   ahead = max(ahead + moved - high - forget, 0),   behind = max(behind + low - moved - forget, 0)
// With a duty that only just moves a finger against friction and load, low shows nothing for long. There the effort
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
constexpr int16_t kTooFast =
    96;  // Q6 in a turn, 750 degrees a second: no duty that is allowed, noise included
constexpr uint8_t kPatience_turns = 2;
constexpr uint8_t kEffort_turns = 11;
constexpr uint8_t kRecoil_turns = 100;

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
    recoil_ = 0;
  }

  // What has stopped a finger throws it back: for a while its movement is not judged.
  void recoil(int16_t measured) {
    start(measured);
    recoil_ = kRecoil_turns;
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
  bool is_rough() const { return rough_ > kRough; }
  bool jumped_again() const { return again_; }

  // Which way it was stalled.
  bool upwards() const { return upwards_; }
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
    if (recoil_ > 0) {
      --recoil_;
      const int16_t moved = static_cast<int16_t>(smooth_ - before_);
      if (moved > kTooFast || moved < -kTooFast) return Verdict::without;
    } else {
      compare(c, static_cast<int16_t>((smooth_ - before_) * (1 << (kSumFraction - 6))));
    }
    before_ = smooth_;
    if (along_ > 0) --along_;
    count_effort(c, duty);
    const bool behind = behind_ > c.gap;
    if (behind || ahead_ > c.gap) {
      upwards_ = behind;
      return behind ? blame(duty > 0, static_cast<int16_t>(since_behind_ - smooth_))
                    : blame(duty < 0, static_cast<int16_t>(smooth_ - since_ahead_));
    }
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
    const bool down = v < 0;
    const int16_t size = static_cast<int16_t>(down ? -v : v);
    const int16_t eighth = static_cast<int16_t>(size >> 3);
    const int16_t way = static_cast<int16_t>(down ? -moved : moved);
    const int16_t fastest = static_cast<int16_t>(size + eighth + (eighth >> 1) + c.load);  // not below 0
    const int16_t high =
        fastest > c.friction ? static_cast<int16_t>(fastest - c.friction) : static_cast<int16_t>(0);
    const int16_t low = slowed(c, static_cast<int16_t>(size - eighth - c.load));
    const int16_t more = static_cast<int16_t>(way - high - c.forget);
    const int16_t less = static_cast<int16_t>(low - way - c.forget);
    if (down) {
      add(ahead_, less, since_ahead_);
      add(behind_, more, since_behind_);
    } else {
      add(ahead_, more, since_ahead_);
      add(behind_, less, since_behind_);
    }
  }
  void add(int16_t& sum, int16_t step, int16_t& since) const {
    sum = static_cast<int16_t>(sum + step);
    if (sum > 0) return;
    sum = 0;
    since = smooth_;
  }

  // `away`: how far the reading has moved away from the model since they agreed. `driven`: against the duty.
  Verdict blame(bool driven, int16_t away) const {
    if (away <= kProgress || (effort_ > 0 && along_ > 0)) return Verdict::stalled;
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
    if (along) along_ = kRecoil_turns;
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
  uint8_t recoil_ = 0;
  uint8_t along_ = 0;
  bool upwards_ = false;
  bool again_ = false;
};

// An input that hangs in the air keeps the charge of the one that was read before it: two neighbours that move alike. Good
// fingers with the same command do so, too. Those are probed by turns, 1.5 degrees to either side, and looked
// at in windows of time: whose readings go on alike is one and the same. Which of both hangs is unknown, and need not be known:
// with the second finger limp, either its reading follows the first's still, or the first's stands still against its duty.
struct Neighbour {
  int8_t probe;   // to be added to the goal, Q4 degrees
  bool shadowed;  // one of both readings is the other's
};
class NeighbourWatch {
 public:
  // At the end of each window of kWindow_ms: the readings of the pair, and by how much more is commanded of the second than of the
  // first, Q4 degrees. `turn` changes with each window.
  void look(uint16_t a, uint16_t b, int16_t commanded, bool turn) {
    const int16_t moved = static_cast<int16_t>(a - a_);
    const int16_t other = static_cast<int16_t>(b - b_);
    const bool near = within(static_cast<int16_t>(a - b), kNear);
    if (!near && !shadowed()) alike_ = 0;
    if (near || shadowed()) weigh(moved, other, static_cast<int16_t>(commanded - commanded_));
    a_ = a;
    b_ = b;
    commanded_ = commanded;
    probe_ = alike_ == 0 || shadowed() || lasting_ == 0 ? 0 : turn ? kProbe : -kProbe;
  }
  bool shadowed() const { return alike_ == kCertain; }
  // Of the second.
  Neighbour of_second() const { return {probe_, shadowed()}; }

  static constexpr uint8_t kWindow_ms = 64;

 private:
  static bool within(int16_t x, int16_t bound) { return x <= bound && x >= -bound; }

  void weigh(int16_t moved, int16_t other, int16_t commanded) {
    const int16_t apart = static_cast<int16_t>(other - moved);
    const bool both = !within(moved, kMoved) && !within(other, kMoved);
    if (shadowed()) {
      if (!within(apart, kAlike)) alike_ = 0;
      return;
    }
    if (both) lasting_ = kLasting;
    if (!both && lasting_ > 0) --lasting_;
    if (!both) return;
    if (!within(apart, kAlike)) {
      if (alike_ > 0) --alike_;
      return;
    }
    if (alike_ == 0) {
      alike_ = 1;
      return;
    }
    if (within(commanded, kCommanded) || !within(moved, kQuick)) return;
    const int16_t followed = static_cast<int16_t>(commanded > 0 ? apart : -apart);
    if (followed < kFollowed) {
      ++alike_;
    } else {
      alike_ = alike_ > 3 ? static_cast<uint8_t>(alike_ - 2) : 1;
    }
  }

  static constexpr int8_t kProbe = 24;       // Q4 degrees
  static constexpr int16_t kCommanded = 40;  // Q4 degrees, commanded to go apart
  static constexpr int16_t kNear = 24;       // counts between both: a shadow reads what the other reads
  static constexpr int16_t kMoved = 7;       // counts, two degrees
  static constexpr int16_t kQuick = 50;      // counts: a motor that does what it can follows no probe
  static constexpr int16_t kAlike = 12;      // counts
  static constexpr int16_t kFollowed = 5;    // counts, less than half of what was commanded
  static constexpr uint8_t kCertain = 4;
  static constexpr uint8_t kLasting = 12;
  uint16_t a_ = 0;
  uint16_t b_ = 0;
  int16_t commanded_ = 0;
  int8_t probe_ = 0;
  uint8_t alike_ = 0;
  uint8_t lasting_ = 0;  // windows since they moved, downwards
};

}  // namespace hand
}  // namespace flexor
