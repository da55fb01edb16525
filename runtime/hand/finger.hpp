// One finger of the hand around its position loop: when it may move, how fast, and what it does when
// something is wrong.
//
// link       goal                       the set-point's speed
// waiting    where it is                none: no frame has come since the start
// following  the last command           full, once it has been reached at the careful speed
// resting    the rest angle             careful: no frame for kHold_ms. A state of its own, not a fault.
// Faults (fault.hpp), each with the motor off: a reading that cannot be, and what motor_watch.hpp finds that the
// duty and the reading disagree about. A finger that was stopped is tried no further that way until its reading
// has moved by two degrees; one that was stopped both ways, or whose reading lies, until the reading is well
// again: see is_well(), and the table in README.md.
// With a motor that is known the set-point slows down before either end of its range, and nothing drives the
// finger past it.
#pragma once

#include "runtime/hand/fault.hpp"
#include "runtime/hand/motor_watch.hpp"
#include "runtime/hand/position_loop.hpp"

namespace flexor {
namespace hand {

constexpr uint16_t kHold_ms = 250;

enum class Link : uint8_t { waiting, following, resting };

// One call a tick and one a frame.
class LinkWatch {
 public:
  void frame() {
    age_ms_ = 0;
    state_ = Link::following;
  }
  Link tick() {
    if (state_ == Link::following && ++age_ms_ > kHold_ms) state_ = Link::resting;
    return state_;
  }

 private:
  uint16_t age_ms_ = 0;
  Link state_ = Link::waiting;
};

// 10-bit reading to Q4 degrees.
struct Potentiometer {
  uint32_t scale;  // Q16 of Q4 degrees per count, below 2^18
  int16_t offset;  // Q4 degrees at count 0
  uint16_t low;    // counts; a reading outside [low, high] is a fault
  uint16_t high;

  bool plausible(uint16_t counts) const { return counts >= low && counts <= high; }
  int16_t operator()(uint16_t counts) const {
    // counts scale in two products of 16 bits.
    const uint16_t small = core::upper_half(core::multiply_add(0x8000, counts, static_cast<uint16_t>(scale)));
    return static_cast<int16_t>(offset +
                                static_cast<int16_t>(counts * static_cast<uint8_t>(scale >> 16) + small));
  }
};

struct FingerSettings {
  LoopSettings loop;
  Potentiometer potentiometer;
  int32_t careful_step;  // Q20 degrees in a tick
  MotorSettings motor;   // rate 0: no soft stop and no watch
};

class Finger {
 public:
  // `command` and `rest` in Q4 degrees, any value; `counts` are the potentiometer's, and `neighbour` the state of
  // the one before. `turn`: every second tick, the watch's. Returns the duty, which the motor must get.
  int16_t tick(const FingerSettings& c, Link link, int16_t command, int16_t rest, uint16_t counts,
               bool turn = true, Neighbour neighbour = {}) {
    const bool watched = c.motor.rate != 0;
    const bool shadowed = watched && neighbour.shadowed;
    if (!c.potentiometer.plausible(counts)) return give_up(Fault::blind);
    const int16_t measured = c.potentiometer(counts);
    if (!awake_ || (is_limp() && recovers(c.loop, measured, shadowed))) wake(c, measured);
    if (is_limp()) return 0;
    // Before the loop: a microcontroller has not the registers for both at a time.
    const Verdict verdict = watched ? watch_.tick(c.motor, turn, duty_, measured) : Verdict::good;
    if (link != Link::following) quick_ = false;
    int16_t goal = link == Link::following ? command : rest;
    if (watched) goal = core::add(goal, neighbour.probe);
    if (link == Link::waiting) goal = setpoint();
    const int16_t duty = step(c.loop, loop_, goal, measured, step_limit(c, goal));
    if (setpoint() == core::clamp(goal, c.loop.lower, c.loop.upper)) quick_ = link == Link::following;
    if (shadowed) return give_up(Fault::floating);
    if (verdict != Verdict::good) return disagree(verdict, measured);
    trusted_ = measured;
    duty_ = watched ? guarded(c, duty, measured) : duty;
    return duty_;
  }

  // The board's fault: off, and a soft start after it.
  void let_go() {
    if (is_limp()) return;
    awake_ = false;
    give_up(Fault::none);
  }

  Fault fault() const { return fault_; }
  // Its motor is off, and its reading runs as no finger coasts and nobody bends one, or it was carried beyond its range
  // since: what drives it follows no duty.
  bool runs_away() const { return runs_away_; }
  int16_t setpoint() const {
    return static_cast<int16_t>(loop_.setpoint >> (core::kStateFraction - core::kOutputFraction));
  }

 private:
  static constexpr uint8_t kUp = 1;
  static constexpr uint8_t kDown = 2;
  static constexpr int32_t kLeastStep = static_cast<int32_t>(1) << 16;  // Q20, 62 degrees a second
  static constexpr int16_t kBeyond = 4;         // Q4 past the command's range: no further
  static constexpr int16_t kGentle = 16;        // Q4 before its end: nothing that could press
  static constexpr int16_t kSame = 16;          // Q4: the set-point has come back
  static constexpr int16_t kAlive = 32;         // Q4: such a movement is none of noise
  static constexpr int16_t kNear = 160;         // Q4: where it was, and what it coasted since
  static constexpr uint8_t kPushed_ticks = 60;  // with so little a finger that is free moves by a degree
  static constexpr uint16_t kGentle_ticks = 8000;
  static constexpr uint8_t kMostGrudge = 3;   // 64 s
  static constexpr uint8_t kLook_ticks = 16;  // the first is for coasting
  static constexpr int16_t kRun = 80;         // Q4 in kLook_ticks: 312 degrees a second
  static constexpr int16_t kCarried = 20;     // Q4 beyond the range
  static constexpr int16_t kThrown = 640;  // Q4: what a kick into the softest thing that is felt gives back
  static constexpr uint8_t kSettled_ticks = 100;  // for a finger to come to rest
  static constexpr uint8_t kRecovered_ticks = 200;

  // Soft start: from where it is, carefully.
  void wake(const FingerSettings& c, int16_t measured) {
    start(c.loop, loop_, measured);
    watch_.start(measured);
    blocked_ = 0;
    if (fault_ == Fault::frozen) stopped_ = 0;  // it lives
    if (fault_ == Fault::reversed) {            // who bent it, nobody knows
      stopped_ = kUp | kDown;
      gentle_ticks_ = kGentle_ticks;
    }
    standing_ticks_ = 0;
    kick_ = 0;
    awake_ = true;
    quick_ = false;
    give_up(Fault::none);
  }

  int16_t give_up(Fault fault) {
    fault_ = fault;
    duty_ = 0;
    limp_ticks_ = standing_ticks_ = 0;
    return 0;
  }

  static bool further(int16_t a, int16_t b, int16_t than) {
    const int16_t apart = static_cast<int16_t>(a - b);
    return apart > than || apart < -than;
  }

  static bool beyond(const LoopSettings& c, int16_t measured) {
    return measured > c.upper + kCarried || measured < c.lower - kCarried;
  }

  bool is_limp() const { return fault_ >= Fault::blind; }

  // The set-point's speed: before the end of its range it falls with the way that is left.
  int32_t step_limit(const FingerSettings& c, int16_t goal) const {
    const int32_t most = quick_ ? c.loop.max_step : c.careful_step;
    if (c.motor.rate == 0) return most;
    const int16_t at = setpoint();
    const int16_t left = static_cast<int16_t>(goal > at ? c.loop.upper - at : at - c.loop.lower);
    const int32_t slow = core::widen<5>(left) + kLeastStep;
    return slow < most ? slow : most;
  }

  // A way that it was stopped on is free once the finger has been at its end, or after a time that grows.
  void forgive(const LoopSettings& c, int16_t measured) {
    if (stopped_ == 0) return;
    const uint8_t here = measured > c.upper - kSame ? kUp : measured < c.lower + kSame ? kDown : 0;
    if ((stopped_ & here) != 0) {
      stopped_ = static_cast<uint8_t>(stopped_ & ~here);
      grudge_ = 0;
    }
    if (--gentle_ticks_ > 0) return;
    stopped_ = 0;
    if (softly_) blocked_ = 0;
  }

  // What of the loop's duty the motor gets.
  int16_t guarded(const FingerSettings& c, int16_t duty, int16_t measured) {
    if (blocked_ != 0 && unblock(c.loop, measured)) return lie(Fault::slipped);
    forgive(c.loop, measured);
    if ((blocked_ & (duty > 0 ? kUp : kDown)) != 0) return hold_back(measured);
    fault_ = Fault::none;
    const int16_t stops_at = static_cast<int16_t>(measured + watch_.coast(c.motor));
    const int16_t left = static_cast<int16_t>(duty > 0 ? c.loop.upper - stops_at : stops_at - c.loop.lower);
    return left < -kBeyond ? static_cast<int16_t>(0) : kicked(c.motor, duty, measured, left);
  }

  // Between the duty that may move a finger and the one that must, it is unknown whether it is held: not for
  // long. A kick goes on until the reading has moved, or the watch has seen enough. `left`: of the way to the end
  // of the range, where nothing begins that could press.
  int16_t kicked(const MotorSettings& c, int16_t duty, int16_t measured, int16_t left) {
    const uint8_t way = duty > 0 ? kUp : kDown;
    const bool gentle = left < kGentle || (stopped_ & way) != 0;
    if (!watch_.held()) {
      kick_ = 0;
      return gentle ? gently(c.breakaway, duty, measured) : duty;
    }
    if (kick_ == 0 && !gentle) kick_ = way;
    if (kick_ != way) return gently(c.breakaway, duty, measured);
    if (way == kUp) return duty < c.kick ? c.kick : duty;
    return duty > -c.kick ? static_cast<int16_t>(-c.kick) : duty;
  }

  // No more than what may move it, and that not for long where it does not.
  int16_t gently(int16_t breakaway, int16_t duty, int16_t measured) {
    const int16_t little = core::clamp<int16_t>(duty, static_cast<int16_t>(-breakaway), breakaway);
    if (little == duty || further(measured, pushed_at_, kSame)) {
      pushed_ticks_ = 0;
      pushed_at_ = measured;
      return little;
    }
    if (++pushed_ticks_ < kPushed_ticks) return little;
    pushed_ticks_ = 0;
    softly_ = blocked_ == 0 || softly_;
    return block(duty > 0 ? kUp : kDown, measured);
  }

  int16_t block(uint8_t way, int16_t measured) {
    blocked_ = static_cast<uint8_t>(blocked_ | way);
    stopped_at_ = measured;
    return hold_back(measured);
  }

  // Tried again where it has moved away with the set-point come back: what gives throws a finger back without.
  // Returns whether the reading went on the way that the finger was stopped on, further back than any thing throws it,
  // or beyond its range: without its motor none does.
  bool unblock(const LoopSettings& c, int16_t measured) {
    const int16_t away = static_cast<int16_t>(measured - stopped_at_);
    const int16_t wanted = static_cast<int16_t>(setpoint() - measured);
    if (away <= kAlive && away >= -kAlive) return false;
    const bool on = blocked_ == (away > 0 ? kUp : kDown);
    if (on || (away > 0 ? wanted > -kSame : wanted < kSame)) blocked_ = 0;
    return on || further(away, 0, kThrown) || beyond(c, measured);
  }

  // Nothing against what has stopped it, until it has moved.
  int16_t hold_back(int16_t measured) {
    const int16_t left = static_cast<int16_t>(setpoint() - measured);
    const bool silent = softly_ && (blocked_ & stopped_) == 0;
    fault_ = !silent && (left > kSame || left < -kSame) ? Fault::stalled : Fault::none;
    loop_.integral = 0;
    return 0;
  }

  void resent() {
    if (grudge_ < kMostGrudge) ++grudge_;
  }
  int16_t lie(Fault fault) {
    resent();
    return give_up(fault);
  }

  FLEXOR_SHARED int16_t disagree(Verdict verdict, int16_t measured) {
    loop_.integral = 0;
    if (verdict == Verdict::against) return lie(Fault::reversed);
    if (verdict != Verdict::stalled) return lie(Fault::slipped);
    const uint8_t way = watch_.upwards() ? kUp : kDown;
    stopped_ = static_cast<uint8_t>(stopped_ | way);
    gentle_ticks_ = static_cast<uint16_t>(kGentle_ticks << grudge_);
    resent();
    watch_.recoil(measured);
    kick_ = 0;
    softly_ = false;
    const int16_t none = block(way, measured);
    duty_ = none;
    return blocked_ == (kUp | kDown) ? give_up(Fault::frozen) : none;
  }

  void look_for_runaway(const LoopSettings& c, int16_t measured) {
    if (standing_ticks_ % kLook_ticks != 0 || watch_.is_rough() || fault_ == Fault::floating) return;
    const bool soon = standing_ticks_ == 2 * kLook_ticks && limp_ticks_ <= 2 * kLook_ticks;
    runs_away_ = standing_ticks_ != kLook_ticks &&
                 ((soon && beyond(c, measured)) || further(measured, pushed_at_, kRun));
    pushed_at_ = measured;
  }

  // At rest first, then long enough without what was wrong, and still: the longer, the more often it lied.
  bool recovers(const LoopSettings& c, int16_t measured, bool shadowed) {
    const bool calm = watch_.calm(measured);
    ++standing_ticks_;
    look_for_runaway(c, measured);
    if (shadowed && !needs_a_bend()) {
      fault_ = Fault::floating;
      limp_ticks_ = kSettled_ticks;
    }
    if (watch_.jumped_again() && fault_ != Fault::noisy)
      fault_ = fault_ == Fault::slipped ? Fault::noisy : Fault::slipped;
    if (limp_ticks_ < kSettled_ticks) stopped_at_ = still_at_ = measured;
    const bool still = !further(measured, still_at_, kSame);
    if (!still) still_at_ = measured;
    if (limp_ticks_ >= kSettled_ticks && !(still && is_well(measured, calm))) {
      limp_ticks_ = kSettled_ticks;
    } else if ((standing_ticks_ & ((1 << grudge_) - 1)) == 0) {
      ++limp_ticks_;
    }
    return limp_ticks_ >= kRecovered_ticks;
  }

  bool needs_a_bend() const { return fault_ == Fault::frozen || fault_ == Fault::reversed; }

  bool is_well(int16_t measured, bool calm) const {
    if (needs_a_bend()) return further(measured, stopped_at_, kAlive);
    return calm && (fault_ == Fault::floating || !further(measured, trusted_, kNear));
  }

  LoopState loop_ = {};
  MotorWatch watch_;
  int16_t duty_ = 0;
  int16_t trusted_ = 0;
  int16_t stopped_at_ = 0;  // while limp: where it came to rest
  int16_t still_at_ = 0;
  uint8_t limp_ticks_ = 0;
  uint8_t standing_ticks_ = 0;
  uint8_t blocked_ = 0;
  int16_t pushed_at_ = 0;
  uint8_t pushed_ticks_ = 0;
  uint16_t gentle_ticks_ = 0;
  uint8_t stopped_ = 0;
  uint8_t grudge_ = 0;
  uint8_t kick_ = 0;
  bool awake_ = false;
  bool quick_ = false;
  bool softly_ = false;
  bool runs_away_ = false;
  Fault fault_ = Fault::none;
};

}  // namespace hand
}  // namespace flexor
