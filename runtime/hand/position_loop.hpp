// One finger's PI position loop, 1 kHz, in integers.
//
//   s_k = s_{k-1} + clamp(clamp(command, lower, upper) - s_{k-1}, -max_step, max_step)     set-point
//   e_k = clamp(s_k - measured_k, -256, 256)
//   u_k = clamp(K_p e_k + I_k + K_v (s_k - s_{k-1}), -duty_limit, duty_limit)            feed-forward of the set-point's speed
//   I_k = clamp(I_{k-1} + K_i e_k, -integral_limit, integral_limit)                        anti-windup by
//   clamping
//
// With [lower, upper] the Psi of Sensors 2019, 19(18), 3896, eq. 6, no command drives a finger into its end
// stop, and an integral_limit below the full duty bounds what a finger that is held can wind up. The article
// names a PI controller and gives neither gains nor limits.
#pragma once

#include "runtime/core/fixed_point.hpp"

namespace flexor {
namespace hand {

constexpr int16_t kFullDuty = 32767;  // the supply's whole voltage
constexpr int kErrorFraction = 8;     // e in Q8 degrees
constexpr int kIntegralFraction = 8;  // I in 2^-8 duty
constexpr int32_t kMaxError = 65535;  // 256 degrees: the product with the largest gain just fits 32 bits
constexpr int kSpeedShift = core::kStateFraction - kErrorFraction;
constexpr int32_t kMaxIntegral = static_cast<int32_t>(1) << 30;

// Limits `value` to [-bound, bound].
inline int32_t limit(int32_t value, int32_t bound) {
  const int32_t raised = value < -bound ? -bound : value;
  return bound < raised ? bound : raised;
}

struct LoopSettings {
  int16_t lower;  // of the command, Q4 degrees
  int16_t upper;
  int32_t max_step;        // set-point's largest change in a tick, Q20 degrees, >= 0
  int16_t proportional;    // K_p: duty per degree
  int16_t integral;        // K_i: 2^-8 duty per degree and tick
  int32_t integral_limit;  // 2^-8 duty, 0 .. kMaxIntegral
  int16_t duty_limit;      // 0 .. kFullDuty
  int16_t feed_forward;    // K_v: duty per degree in a tick, >= 0
};

struct LoopState {
  int32_t setpoint;  // Q20 degrees
  int32_t integral;  // 2^-8 duty
};

// Starts where the finger is: no jump, whatever the first command.
inline void start(const LoopSettings& c, LoopState& state, int16_t measured) {
  state.setpoint = static_cast<int32_t>(core::clamp(measured, c.lower, c.upper))
                   << (core::kStateFraction - core::kOutputFraction);
  state.integral = 0;
}

// One tick. command and measured in Q4 degrees, any value; max_step takes the place of the settings'. Returns the duty, signed.
inline int16_t step(const LoopSettings& c, LoopState& state, int16_t command, int16_t measured, int32_t max_step) {
  const int32_t goal = static_cast<int32_t>(core::clamp(command, c.lower, c.upper))
                       << (core::kStateFraction - core::kOutputFraction);
  const int32_t moved = limit(goal - state.setpoint, max_step);
  state.setpoint += moved;
  const int32_t error =
      limit((state.setpoint >> (core::kStateFraction - kErrorFraction)) -
                static_cast<int32_t>(measured) * (1 << (kErrorFraction - core::kOutputFraction)),
            kMaxError);
  const int32_t wanted = ((c.proportional * error) >> kErrorFraction) + (state.integral >> kIntegralFraction) +
                         ((c.feed_forward * limit(moved >> kSpeedShift, kMaxError)) >> kErrorFraction);
  state.integral = limit(state.integral + ((c.integral * error) >> kErrorFraction), c.integral_limit);
  return static_cast<int16_t>(limit(wanted, c.duty_limit));
}

inline int16_t step(const LoopSettings& c, LoopState& state, int16_t command, int16_t measured) {
  return step(c, state, command, measured, c.max_step);
}

}  // namespace hand
}  // namespace flexor
