// One finger's PI position loop, 1 kHz, in integers.
//
//   s_k = s_{k-1} + clamp(clamp(command, lower, upper) - s_{k-1}, -max_step, max_step)     set-point
//   e_k = clamp(s_k - measured_k, -128, 128)
//   u_k = clamp(K_p e_k + I_k + K_v (s_k - s_{k-1}), -duty_limit, duty_limit)
//   I_k = clamp(I_{k-1} + K_i e_k, -integral_limit, integral_limit)
//
// K_v feeds the set-point's speed forward; the clamp on I is the anti-windup.
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
constexpr int16_t kMaxError = 2047;   // Q4, 128 degrees: e just fits 16 bits, and its products 32
constexpr int32_t kMaxIntegral = static_cast<int32_t>(1) << 30;

// Limits `value` to [-bound, bound].
inline int32_t limit(int32_t value, int32_t bound) {
  const int32_t raised = value < -bound ? -bound : value;
  return bound < raised ? bound : raised;
}

// Q20 to Q8, rounded down, from the upper half and the lower one: a microcontroller shifts 32 bits one by
// one. |high| <= kMaxError.
inline int16_t to_q8(int16_t high, uint16_t low) {
  return static_cast<int16_t>(static_cast<uint16_t>(static_cast<uint16_t>(high) << 4) | (low >> 12));
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

// One tick. command and measured in Q4 degrees, any value; max_step takes the place of the settings'. Returns
// the duty, signed.
inline int16_t step(const LoopSettings& c, LoopState& state, int16_t command, int16_t measured,
                    int32_t max_step) {
  const int32_t goal = static_cast<int32_t>(core::clamp(command, c.lower, c.upper))
                       << (core::kStateFraction - core::kOutputFraction);
  const int32_t moved = limit(goal - state.setpoint, max_step);
  state.setpoint += moved;
  const int16_t apart = core::subtract(static_cast<int16_t>(state.setpoint >> 16), measured);
  const int16_t error =
      to_q8(core::clamp<int16_t>(apart, -kMaxError - 1, kMaxError), static_cast<uint16_t>(state.setpoint));
  const int16_t speed =
      to_q8(core::clamp<int16_t>(static_cast<int16_t>(moved >> 16), -kMaxError - 1, kMaxError),
            static_cast<uint16_t>(moved));
  const int32_t wanted = ((static_cast<int32_t>(c.proportional) * error) >> kErrorFraction) +
                         (state.integral >> kIntegralFraction) +
                         ((static_cast<int32_t>(c.feed_forward) * speed) >> kErrorFraction);
  state.integral = limit(state.integral + ((static_cast<int32_t>(c.integral) * error) >> kErrorFraction),
                         c.integral_limit);
  return static_cast<int16_t>(limit(wanted, c.duty_limit));
}

inline int16_t step(const LoopSettings& c, LoopState& state, int16_t command, int16_t measured) {
  return step(c, state, command, measured, c.max_step);
}

}  // namespace hand
}  // namespace flexor
