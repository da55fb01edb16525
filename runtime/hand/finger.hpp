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
  // `command` and `rest` in Q4 degrees, any value; `counts` are the potentiometer's, and `shadowed` when they are
  // a neighbour's. `turn`: every second tick, the watch's. Returns the duty, which the motor must get.
  int16_t tick(const FingerSettings& c, Link link, int16_t command, int16_t rest, uint16_t counts,
               bool turn = true, bool shadowed = false) {
    if (!c.potentiometer.plausible(counts)) return give_up(Fault::blind);
    const int16_t measured = c.potentiometer(counts);
    if (!awake_ || (is_limp() && recovers(measured, shadowed && c.motor.rate != 0))) wake(c, measured);
    if (is_limp()) return 0;
    const bool watched = c.motor.rate != 0;
    // Before the loop: a microcontroller has not the registers for both at a time.
    const Verdict verdict = watched ? watch_.tick(c.motor, turn, duty_, measured) : Verdict::good;
    if (link != Link::following) quick_ = false;
    int16_t goal = link == Link::following ? command : rest;
    if (link == Link::waiting) goal = held_;
    const int16_t duty = step(c.loop, loop_, goal, measured, step_limit(c, goal));
    if (setpoint() == core::clamp(goal, c.loop.lower, c.loop.upper)) quick_ = link == Link::following;
    if (shadowed && watched) return give_up(Fault::floating);
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
  int16_t setpoint() const {
    return static_cast<int16_t>(loop_.setpoint >> (core::kStateFraction - core::kOutputFraction));
  }

 private:
  static constexpr uint8_t kUp = 1;
  static constexpr uint8_t kDown = 2;
  static constexpr int32_t kLeastStep = static_cast<int32_t>(1) << 16;  // Q20, 62 degrees a second
  static constexpr int16_t kBeyond = 4;           // Q4 past the command's range: no further
  static constexpr int16_t kGentle = 16;          // Q4 before its end: nothing that could press
  static constexpr int16_t kSame = 16;            // Q4: the set-point has come back
  static constexpr int16_t kAlive = 32;           // Q4: such a movement is none of noise
  static constexpr int16_t kNear = 160;           // Q4: where it was, and what it coasted since
  static constexpr uint8_t kSettled_ticks = 100;  // for a finger to come to rest
  static constexpr uint8_t kRecovered_ticks = 200;

  // Soft start: from where it is, carefully.
  void wake(const FingerSettings& c, int16_t measured) {
    start(c.loop, loop_, measured);
    watch_.start(measured);
    held_ = setpoint();
    blocked_ = 0;
    kick_ = 0;
    awake_ = true;
    quick_ = false;
    give_up(Fault::none);
  }

  int16_t give_up(Fault fault) {
    fault_ = fault;
    duty_ = 0;
    limp_ticks_ = 0;
    return 0;
  }

  static bool further(int16_t a, int16_t b, int16_t than) {
    const int16_t apart = static_cast<int16_t>(a - b);
    return apart > than || apart < -than;
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

  // What of the loop's duty the motor gets.
  int16_t guarded(const FingerSettings& c, int16_t duty, int16_t measured) {
    if (further(measured, blocked_at_, kAlive)) blocked_ = 0;
    if ((blocked_ & (duty > 0 ? kUp : kDown)) != 0) return hold_back(measured);
    fault_ = Fault::none;
    const int16_t stops_at = static_cast<int16_t>(measured + watch_.coast(c.motor));
    const int16_t left = static_cast<int16_t>(duty > 0 ? c.loop.upper - stops_at : stops_at - c.loop.lower);
    return left < -kBeyond ? static_cast<int16_t>(0) : kicked(c.motor, duty, left);
  }

  // Between the duty that may move a finger and the one that must, nobody can tell whether it is held: not for
  // long. A kick goes on until the reading has moved, or the watch has seen enough. `left`: of the way to the end
  // of the range, where nothing begins that could press.
  int16_t kicked(const MotorSettings& c, int16_t duty, int16_t left) {
    const uint8_t way = duty > 0 ? kUp : kDown;
    if (!watch_.held()) {
      kick_ = 0;
      return left < kGentle ? core::clamp<int16_t>(duty, static_cast<int16_t>(-c.breakaway), c.breakaway)
                            : duty;
    }
    if (kick_ == 0 && left >= kGentle) kick_ = way;
    if (kick_ != way) return core::clamp<int16_t>(duty, static_cast<int16_t>(-c.breakaway), c.breakaway);
    if (way == kUp) return duty < c.kick ? c.kick : duty;
    return duty > -c.kick ? static_cast<int16_t>(-c.kick) : duty;
  }

  // Nothing against what has stopped it, until it has moved.
  int16_t hold_back(int16_t measured) {
    const int16_t left = static_cast<int16_t>(setpoint() - measured);
    fault_ = left > kSame || left < -kSame ? Fault::stalled : Fault::none;
    loop_.integral = 0;
    return 0;
  }

  int16_t disagree(Verdict verdict, int16_t measured) {
    loop_.integral = 0;
    if (verdict == Verdict::jumped) return give_up(Fault::slipped);
    if (verdict == Verdict::against) return give_up(Fault::reversed);
    if (verdict == Verdict::without) return give_up(Fault::slipped);
    blocked_ = static_cast<uint8_t>(blocked_ | (duty_ > 0 ? kUp : kDown));
    blocked_at_ = measured;
    watch_.start(measured);
    return give_up(blocked_ == (kUp | kDown) ? Fault::frozen : Fault::stalled);
  }

  // At rest first, then long enough without what was wrong.
  bool recovers(int16_t measured, bool shadowed) {
    const bool calm = watch_.calm(measured);
    if (shadowed) fault_ = Fault::floating;
    if (watch_.jumped_again() && fault_ != Fault::noisy)
      fault_ = fault_ == Fault::slipped ? Fault::noisy : Fault::slipped;
    if (limp_ticks_ < kSettled_ticks) limp_at_ = measured;
    if (limp_ticks_ < kSettled_ticks || is_well(measured, calm)) {
      ++limp_ticks_;
    } else {
      limp_ticks_ = kSettled_ticks;
    }
    return limp_ticks_ >= kRecovered_ticks;
  }

  bool is_well(int16_t measured, bool calm) const {
    if (fault_ == Fault::frozen || fault_ == Fault::reversed) return further(measured, limp_at_, kAlive);
    return calm && (fault_ == Fault::floating || !further(measured, trusted_, kNear));
  }

  LoopState loop_ = {};
  MotorWatch watch_;
  int16_t duty_ = 0;
  int16_t held_ = 0;
  int16_t trusted_ = 0;
  int16_t blocked_at_ = 0;
  int16_t limp_at_ = 0;
  uint8_t limp_ticks_ = 0;
  uint8_t blocked_ = 0;
  uint8_t kick_ = 0;
  bool awake_ = false;
  bool quick_ = false;
  Fault fault_ = Fault::none;
};

}  // namespace hand
}  // namespace flexor
