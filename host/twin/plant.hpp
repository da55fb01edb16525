// The part of the twin that moves every millisecond: cloth and sensor on the glove's side, loop, motor, gear
// and joint on the hand's. One lane is one finger of one trial; lanes know nothing of each other, so that a
// trial gives the same bits whatever runs beside it and however wide the processor's vectors are.
//
// Glove, rho the finger's angle, h = 1 ms:
//   s   = clamp(s, rho - slip, rho + slip)                       cloth slips: a play
//   v  += (s - v) h / (tau_v + h),  z += (s - z) h / (tau_c + h)     visco-elastic lag, creep
//   bend = s + visco (v - s) + creep (z - s)
// Hand, behind the gear, omega in rad/s, u the duty of runtime/hand:
//   i   = clamp((V u - K_e omega) / R, -I_max, I_max)
//   omega* = (omega + h (K_t i + d) / J) / (1 + h b / J)          viscous friction, implicit: never adds
//   energy omega  = sign(omega*) max(|omega*| - h T_c / J, 0)             Coulomb friction, as an impulse:
//   never adds energy joint = clamp(joint, motor - backlash, motor + backlash), inside Psi; an end stop takes
//   the motor's speed away
// End stops that give, with stop_stiffness_mNm_deg above 0: the motor goes up to kGive_deg further, and d gets
//   -(k past + c omega), never away from the joint's middle
// A joint cannot leave Psi, or hardly, so what its stops suffer is measured instead:
//   impacts  how often a motor came to a stop; impact the greatest |omega| at that
//   pressed  the time that a motor was at a stop with a duty of at least kPressingDuty towards it
// K_t includes the gear's efficiency, K_e does not; J is rotor N^2 + finger.
#pragma once

#include <cstdint>

#include "host/twin/parameters.hpp"
#include "runtime/hand/position_loop.hpp"

namespace flexor::twin {

// A tenth of the supply: twice what the shipped motor's friction holds back.
inline constexpr std::int16_t kPressingDuty = hand::kFullDuty / 10;

// No stop gives more than that.
inline constexpr float kGive_deg = 10;

// The same for every lane.
struct PlantConstants {
  explicit PlantConstants(const Parameters& parameters);

  float slip_deg;
  float visco_rate;  // h / (tau + h)
  float creep_rate;
  float visco_share;
  float creep_share;
  float amp_per_duty;   // V / (R full duty)
  float amp_per_deg_s;  // K_e / R
  float current_limit_A;
  float deg_s_per_amp;  // K_t h / J
  float deg_s_per_mNm;  // h / J
  float viscous;        // 1 / (1 + h b / J)
  float coulomb_deg_s;  // h T_c / J
  float backlash_deg;
  float give_deg;            // of the stops
  float stop_mNm_per_deg;    // stiffness
  float stop_mNm_per_deg_s;  // damping
  float counts_per_deg;      // potentiometer
  float q4_per_count;
  float noise_counts;  // for one unit of the raw noise sum
  hand::LoopSettings loop;
};

template <int kLanes>
struct alignas(64) PlantState {
  float reference[kLanes];        // rho, degrees
  float reference_slope[kLanes];  // degrees in a step
  float slipped[kLanes];
  float visco[kLanes];
  float creep[kLanes];
  float motor[kLanes];  // behind the gear, degrees
  float speed[kLanes];  // degrees per second
  float joint[kLanes];  // degrees
  float lower[kLanes];  // Psi, degrees
  float upper[kLanes];
  float disturbance[kLanes];   // mNm
  float error_deg_ms[kLanes];  // integral of |rho - joint| since it was last taken
  float impact_deg_s[kLanes];  // fastest so far
  std::int32_t impacts[kLanes];
  std::int32_t pressed_ms[kLanes];
  std::int32_t command[kLanes];  // Q4 degrees
  std::int32_t setpoint[kLanes];
  std::int32_t integral[kLanes];
  std::uint32_t noise[kLanes];  // xorshift32 (Marsaglia 2003), never 0
};

template <int kLanes>
float bend(const PlantConstants& c, const PlantState<kLanes>& x, int lane) {
  return x.slipped[lane] + c.visco_share * (x.visco[lane] - x.slipped[lane]) +
         c.creep_share * (x.creep[lane] - x.slipped[lane]);
}

// One millisecond of every lane.
void advance(const PlantConstants& constants, PlantState<80>& state);
void advance(const PlantConstants& constants, PlantState<40>& state);
// The same equations for one trial, one finger after another, without vector instructions: the yardstick for
// speed, and a check of the other, which must agree to the bit.
void advance(const PlantConstants& constants, PlantState<5>& state);

}  // namespace flexor::twin
