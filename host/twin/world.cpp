#include "host/twin/world.hpp"

#include <algorithm>
#include <cmath>

#include "host/twin/plant_step.hpp"

namespace flexor::twin {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

std::int32_t settled_integral(const hand::LoopSettings& c, double rest_s, std::int32_t command_q4,
                              float lower_deg, float upper_deg) {
  const float command_deg = static_cast<float>(std::clamp<std::int32_t>(command_q4, c.lower, c.upper)) / 16;
  const float behind_deg = command_deg - std::clamp(command_deg, lower_deg, upper_deg);
  const double integral =
      static_cast<double>(c.integral) * static_cast<double>(behind_deg) * rest_s / kStep_s;
  const double limit = c.integral_limit;
  return static_cast<std::int32_t>(std::clamp(integral, -limit, limit));
}

World::World(const TrialInput& input, std::uint64_t number)
    : input_(input),
      p_(input.parameters),
      constants_(p_),
      divider_(p_),
      end_ms_(std::lround(input.motion.duration_s() * 1000)),
      frames_(static_cast<std::size_t>(input.motion.duration_s() * p_.camera_rate_hz) + 1) {
  const std::uint64_t seed = seed_of(input.seed, number);
  const double period_s = input.compensator.sample_period_s;
  variation_ = draw_variation(p_, seed);
  phase_s_ = period_s * Random(seed_of(seed, Purpose::phase)).uniform();
  camera_noise_ = Random(seed_of(seed, Purpose::camera));
  for (int i = 0; i < kFingers; ++i) {
    strip_[at(i)] = Strip(p_, i, period_s, seed_of(seed, Purpose::sensor, i));
    disturbance_[at(i)] = Disturbance(p_, seed_of(seed, Purpose::disturbance, i));
    x_.noise[i] = static_cast<std::uint32_t>(seed_of(seed, Purpose::potentiometer, i)) | 1U;
    const auto rho = static_cast<float>(input.motion.angle(i, -1, variation_));
    x_.reference[i] = x_.slipped[i] = x_.visco[i] = x_.creep[i] = rho;
    x_.lower[i] = static_cast<float>(p_.hand_lower_deg[at(i)]);
    x_.upper[i] = static_cast<float>(p_.hand_upper_deg[at(i)]);
    x_.motor[i] = x_.joint[i] = std::clamp(rho, x_.lower[i], x_.upper[i]);
    x_.command[i] = static_cast<std::int32_t>(std::lround(16 * x_.joint[i]));
    x_.setpoint[i] = x_.command[i] << 16;
    reference_[at(i)] = static_cast<double>(rho);
    potentiometer_[at(i)] = detail::read_potentiometer(constants_, x_, i);
  }
}

int World::glove_counts(int finger, double t_s) {
  return strip_[at(finger)].sample(divider_, t_s, static_cast<double>(bend(constants_, x_, finger)));
}

void World::settle() {
  for (int i = 0; i < kFingers; ++i) x_.slipped[i] = x_.visco[i] = x_.creep[i] = x_.reference[i];
}

void World::begin_step() {
  if ((now_ms_ - kStart_ms) % kBlock_ms == 0) begin_block();
}

void World::end_step() {
  look();
  ++now_ms_;
}

void World::command(const std::array<std::int16_t, kFingers>& angle_q4) {
  std::ranges::copy(angle_q4, x_.command);
}

void World::step() {
  begin_step();
  advance(constants_, x_);
  end_step();
}

void World::step(const std::array<std::int16_t, kFingers>& duty) {
  begin_step();
  for (int i = 0; i < kFingers; ++i) {
    detail::move_glove(constants_, x_, i);
    detail::move_hand(constants_, x_, i, duty[at(i)]);
    potentiometer_[at(i)] = detail::read_potentiometer(constants_, x_, i);
  }
  end_step();
}

void World::begin_block() {
  const double next_s = static_cast<double>(now_ms_ + kBlock_ms) / 1000;
  for (int i = 0; i < kFingers; ++i) {
    const double rho =
        finger_at ? finger_at(i, now_ms_ + kBlock_ms) : input_.motion.angle(i, next_s, variation_);
    x_.reference[i] = static_cast<float>(reference_[at(i)]);
    x_.reference_slope[i] = static_cast<float>((rho - reference_[at(i)]) / kBlock_ms);
    reference_[at(i)] = rho;
    // simulate() starts later: its draws begin there.
    if (now_ms_ >= -kWarmUp_ms) x_.disturbance[i] = static_cast<float>(disturbance_[at(i)].next());
    if (now_ms_ > 0) total_error_[at(i)] += static_cast<double>(x_.error_deg_ms[i]);
    x_.error_deg_ms[i] = 0;
    if (now_ms_ == 0) forget_stops(x_, i);
  }
}

void World::look() {
  if (glove_frame_ < frames_ &&
      now_ms_ >= frame_ms(glove_frame_, p_.camera_rate_hz, p_.glove_camera_latency_s)) {
    shoot(&Trial::glove_deg, x_.reference);
    ++glove_frame_;
  }
  if (hand_frame_ < frames_ &&
      now_ms_ >= frame_ms(hand_frame_, p_.camera_rate_hz, p_.hand_camera_latency_s)) {
    shoot(&Trial::hand_deg, x_.joint);
    ++hand_frame_;
  }
}

void World::shoot(std::array<std::vector<float>, kFingers> Trial::*view, const float* angle) {
  for (int i = 0; i < kFingers; ++i) {
    const double noise = p_.camera_noise_deg * camera_noise_.normal();
    (trial_.*view)[at(i)].push_back(angle[i] + static_cast<float>(noise));
  }
}

std::int32_t World::settled_integral(int finger, std::int16_t command_q4) const {
  return twin::settled_integral(constants_.loop, p_.rest_s, command_q4, x_.lower[finger], x_.upper[finger]);
}

Trial World::finish() {
  for (int i = 0; i < kFingers; ++i) {
    trial_.error_deg_s[at(i)] = (total_error_[at(i)] + static_cast<double>(x_.error_deg_ms[i])) / 1000;
    trial_.impacts[at(i)] = x_.impacts[i];
    trial_.impact_deg_s[at(i)] = static_cast<double>(x_.impact_deg_s[i]);
    trial_.pressed_s[at(i)] = x_.pressed_ms[i] * kStep_s;
  }
  return std::move(trial_);
}

}  // namespace flexor::twin
