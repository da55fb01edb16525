// The step itself, shared by plant.cpp (vectors) and plant_scalar.cpp (not).
#pragma once

#include "host/twin/plant.hpp"

namespace flexor::twin::detail {

inline float limit(float x, float low, float high) {
  const float raised = x < low ? low : x;
  return high < raised ? high : raised;
}

// No branch depends on data and no lane on another: compilers turn the loops over lanes into vector code.

template <int kLanes>
[[gnu::always_inline]] inline void move_glove(const PlantConstants& c, PlantState<kLanes>& x, int i) {
  const float rho = x.reference[i] + x.reference_slope[i];
  const float slipped = limit(x.slipped[i], rho - c.slip_deg, rho + c.slip_deg);
  x.reference[i] = rho;
  x.slipped[i] = slipped;
  x.visco[i] += (slipped - x.visco[i]) * c.visco_rate;
  x.creep[i] += (slipped - x.creep[i]) * c.creep_rate;
}

// The potentiometer's reading: 10 bits, noise from the sum of four bytes.
template <int kLanes>
[[gnu::always_inline]] inline std::int32_t read_potentiometer(const PlantConstants& c, PlantState<kLanes>& x,
                                                              int i) {
  std::uint32_t noise = x.noise[i];
  noise ^= noise << 13;
  noise ^= noise >> 17;
  noise ^= noise << 5;
  x.noise[i] = noise;
  const auto sum =
      static_cast<std::int32_t>((noise & 255U) + (noise >> 8 & 255U) + (noise >> 16 & 255U) + (noise >> 24)) -
      510;
  const float reading = x.motor[i] * c.counts_per_deg + c.noise_counts * static_cast<float>(sum) + 0.5F;
  return static_cast<std::int32_t>(limit(reading, 0.0F, 1023.0F));
}

// What a stop that gives adds to the load: past is how far the motor is behind it.
[[gnu::always_inline]] inline float stop_mNm(const PlantConstants& c, float past, float speed) {
  const float pushes = -c.stop_mNm_per_deg * past - c.stop_mNm_per_deg_s * speed;
  constexpr float kAny = 1e9F;
  return limit(pushes, past > 0 ? -kAny : 0.0F, past < 0 ? kAny : 0.0F);
}

template <int kLanes>
[[gnu::always_inline]] inline void move_hand(const PlantConstants& c, PlantState<kLanes>& x, int i,
                                             std::int16_t duty) {
  const float amp = limit(c.amp_per_duty * static_cast<float>(duty) - c.amp_per_deg_s * x.speed[i],
                          -c.current_limit_A, c.current_limit_A);
  const float lowest = x.lower[i] - c.backlash_deg;
  const float highest = x.upper[i] + c.backlash_deg;
  const float was = x.motor[i];
  const float load = x.disturbance[i] + stop_mNm(c, was - limit(was, lowest, highest), x.speed[i]);
  const float pushed = (x.speed[i] + c.deg_s_per_amp * amp + c.deg_s_per_mNm * load) * c.viscous;
  const float speed = pushed - limit(pushed, -c.coulomb_deg_s, c.coulomb_deg_s);
  const float wanted = was + speed * 0.001F;
  const float motor = limit(wanted, lowest - c.give_deg, highest + c.give_deg);
  const float fast = speed < 0 ? -speed : speed;
  // Rigid: the stop takes the speed of a motor that was not there. Elastic: it comes past where the stop begins.
  const bool rigid = wanted != motor && motor != was;
  const bool elastic = (motor > highest && was <= highest) || (motor < lowest && was >= lowest);
  const float impact = rigid || elastic ? fast : 0.0F;
  x.impacts[i] += rigid || elastic ? 1 : 0;
  x.impact_deg_s[i] = x.impact_deg_s[i] < impact ? impact : x.impact_deg_s[i];
  x.speed[i] = wanted == motor ? speed : 0.0F;
  x.motor[i] = motor;
  const std::int32_t up = duty >= kPressingDuty && motor >= highest ? 1 : 0;
  const std::int32_t down = duty <= -kPressingDuty && motor <= lowest ? 1 : 0;
  x.pressed_ms[i] += up + down;
  const float joint = limit(limit(x.joint[i], motor - c.backlash_deg, motor + c.backlash_deg),
                            x.lower[i] - c.give_deg, x.upper[i] + c.give_deg);
  x.joint[i] = joint;
  const float error = x.reference[i] - joint;
  x.error_deg_ms[i] += error < 0 ? -error : error;
}

template <int kLanes>
[[gnu::always_inline]] inline void advance(const PlantConstants& c, PlantState<kLanes>& x) {
  for (int i = 0; i < kLanes; ++i) {
    move_glove(c, x, i);
    // Not lround, which no compiler turns into vectors; the sum is never negative.
    const auto measured =  // NOLINTNEXTLINE(bugprone-incorrect-roundings)
        static_cast<std::int16_t>(static_cast<float>(read_potentiometer(c, x, i)) * c.q4_per_count + 0.5F);
    hand::LoopState state{x.setpoint[i], x.integral[i]};
    const std::int16_t duty = hand::step(c.loop, state, static_cast<std::int16_t>(x.command[i]), measured);
    x.setpoint[i] = state.setpoint;
    x.integral[i] = state.integral;
    move_hand(c, x, i, duty);
  }
}

}  // namespace flexor::twin::detail
