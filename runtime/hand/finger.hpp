// One finger of the hand around its position loop: when it may move, how fast, and what it does when
// something is wrong.
//
// link       goal                       the set-point's speed
// waiting    where it is                none: no frame has come since the start
// following  the last command           full, once it has been reached at the careful speed
// resting    the rest angle             careful: no frame for kHold_ms. A state of its own, not a fault.
// Faults, each with the motor off: `blind`, the potentiometer's reading is on a rail; `stalled`, full effort
// and no movement for stall_ticks. A stalled finger is free again when the set-point comes back to it; a
// blind one when it sees.
#pragma once

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
    return static_cast<int16_t>(offset + static_cast<int16_t>((counts * scale + 0x8000) >> 16));
  }
};

struct FingerSettings {
  LoopSettings loop;
  Potentiometer potentiometer;
  int32_t careful_step;  // Q20 degrees in a tick
  int16_t stall_duty;    // effort from which standing still counts
  uint16_t stall_ticks;  // UINT16_MAX: never
  int16_t stall_travel;  // Q4 degrees that are movement
};

enum class Fault : uint8_t { none = 0, stalled = 1, blind = 2 };

class Finger {
 public:
  // `command` and `rest` in Q4 degrees, any value; `counts` are the potentiometer's. Returns the duty.
  int16_t tick(const FingerSettings& c, Link link, int16_t command, int16_t rest, uint16_t counts) {
    if (!c.potentiometer.plausible(counts)) {
      fault_ = Fault::blind;
      return 0;
    }
    const int16_t measured = c.potentiometer(counts);
    if (!awake_ || fault_ == Fault::blind) wake(c, measured);
    if (link != Link::following) careful_ = true;
    int16_t goal = link == Link::following ? command : rest;
    if (link == Link::waiting) goal = held_;
    const int16_t duty = step(c.loop, loop_, goal, measured, careful_ ? c.careful_step : c.loop.max_step);
    if (reached(c, goal)) careful_ = link != Link::following;
    return stalled(c, duty, measured) ? static_cast<int16_t>(0) : duty;
  }

  Fault fault() const { return fault_; }
  int16_t setpoint() const {
    return static_cast<int16_t>(loop_.setpoint >> (core::kStateFraction - core::kOutputFraction));
  }

 private:
  // Soft start: from where it is, carefully.
  void wake(const FingerSettings& c, int16_t measured) {
    start(c.loop, loop_, measured);
    held_ = setpoint();
    still_at_ = measured;
    still_ticks_ = 0;
    awake_ = true;
    careful_ = true;
    fault_ = Fault::none;
  }

  bool reached(const FingerSettings& c, int16_t goal) const {
    return setpoint() == core::clamp(goal, c.loop.lower, c.loop.upper);
  }

  bool stalled(const FingerSettings& c, int16_t duty, int16_t measured) {
    if (fault_ == Fault::stalled) {
      const int16_t left = static_cast<int16_t>(setpoint() - measured);
      if (pushed_up_ ? left > c.stall_travel : left < -c.stall_travel) return true;
      fault_ = Fault::none;
      loop_.integral = 0;
      still_ticks_ = 0;
    }
    const int16_t moved = static_cast<int16_t>(measured - still_at_);
    const bool pushes = duty >= c.stall_duty || duty <= -c.stall_duty;
    if (!pushes || moved > c.stall_travel || moved < -c.stall_travel) {
      still_at_ = measured;
      still_ticks_ = 0;
      return false;
    }
    if (c.stall_ticks == UINT16_MAX || ++still_ticks_ < c.stall_ticks) return false;
    fault_ = Fault::stalled;
    pushed_up_ = duty > 0;
    return true;
  }

  LoopState loop_ = {};
  int16_t held_ = 0;
  int16_t still_at_ = 0;
  uint16_t still_ticks_ = 0;
  bool awake_ = false;
  bool careful_ = true;
  bool pushed_up_ = false;
  Fault fault_ = Fault::none;
};

}  // namespace hand
}  // namespace flexor
