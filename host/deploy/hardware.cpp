#include "host/deploy/hardware.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

constexpr double kSafeIntegralLimit = 0.25;  // of full duty: four times the friction
constexpr double kSafeSpeed_deg_s = 400;
constexpr double kTopSpeed_deg_s = 440;  // of a motor that the greatest load helps
constexpr double kSoftStop_deg = 2;      // before the joint's own
constexpr double kReach_deg = 15;        // past which a reading is none
constexpr double kSameEnds = 0.1;        // of the hand's range, within which a model's ends are the hand's

// T = K_t V / R and b = K_t K_e / R + viscous, behind the gear: full speed T / b, time J / b.
HandMotor motor_of(const model::Hardware& p) {
  constexpr double kDeg_per_rad = 180 / std::numbers::pi;
  const double stall_mNm = p.torque_mNm_A() * p.motor_V / p.resistance_ohm;
  const double damping_mNms = p.torque_mNm_A() * p.back_emf_Vs() / p.resistance_ohm + p.viscous_mNms_rad;
  return {stall_mNm / damping_mNms * kDeg_per_rad, p.inertia_mNms2() / damping_mNms,
          p.coulomb_mNm / stall_mNm, p.disturbance_mNm / stall_mNm};
}

// Away from the joints' ends, which its limits are, and at bounded effort and speed, whatever it asks for.
void limit(Hand& hand) {
  for (std::size_t i = 0; i < kFingers; ++i) {
    const double soft_deg = std::min(kSoftStop_deg, (hand.upper_deg[i] - hand.lower_deg[i]) / 4);
    hand.lower_deg[i] += soft_deg;
    hand.upper_deg[i] -= soft_deg;
  }
  hand.reach_deg = kReach_deg;
  // The fastest motor of this kind, and the one with the least friction.
  const double fastest_deg_s = (1 + kMotorSpeedShare) * hand.motor.full_speed_deg_s;
  const double least_friction = (1 - kMotorFrictionShare) * hand.motor.friction;
  model::Hardware& h = hand.hardware;
  h.loop_duty = std::min(h.loop_duty, kTopSpeed_deg_s / fastest_deg_s + least_friction - hand.motor.load);
  h.loop_integral_limit = std::min(h.loop_integral_limit, kSafeIntegralLimit);
  h.loop_speed_deg_s = std::min(h.loop_speed_deg_s, kSafeSpeed_deg_s);
}

// A board's converter counts to 1023, whatever the one of the log counted to.
void check_bits(const model::Model& model) {
  for (const model::Input& input : model.inputs) {
    if (input.unit == "count" && input.valid_max > sensor::kAdcTop)
      throw io::InputError(
          "{}: its log counts to {:g}, an {} to {}: record the glove with that board, or flexor "
          "export --to cpp for firmware of your own",
          input.name, input.valid_max, kAtmega328p.printed, sensor::kAdcTop);
  }
}

}  // namespace

Glove glove_that_runs(const model::Hardware& p, const model::Model& model, const Key& key,
                      const CalibrationDocument& calibration) {
  check_bits(model);
  const Sensor alpha = divider(p.divider_kohm, p.flat_kohm, p.kohm_per_deg);
  return {.model = model,
          .sensor = sensors_of(model, alpha, calibration),
          .baud = p.baud,
          .frame_rate_hz = p.frame_rate_hz,
          .key = key,
          .pins = p.pins};
}

Glove glove_for(const model::Hardware& p, const model::Model& model, const Key& key,
                const CalibrationDocument& calibration) {
  Glove glove = glove_that_runs(p, model, key, calibration);
  fold_corrections(glove);
  return glove;
}

Hand unprotected_hand(const model::Hardware& p, const model::Model& model, const Key& key) {
  Hand hand;
  hand.hardware = p;
  hand.lower_deg.fill(p.loop_lower_deg);
  hand.upper_deg.fill(p.loop_upper_deg);
  hand.key = key;
  hand.rest_deg = p.hand_lower_deg;
  const model::Wiring wiring = model::wiring_of(model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.joint[i]) continue;
    const double rest_deg = model.joints[*wiring.joint[i]].rest_deg;
    hand.rest_deg[i] = std::clamp(rest_deg, p.hand_lower_deg[i], p.hand_upper_deg[i]);
  }
  return hand;
}

Hand safe_hand(const model::Hardware& p, const model::Model& model, const Key& key) {
  Hand hand = unprotected_hand(p, model, key);
  for (std::size_t i = 0; i < kFingers; ++i) {
    hand.lower_deg[i] = std::max(hand.lower_deg[i], p.hand_lower_deg[i]);
    hand.upper_deg[i] = std::min(hand.upper_deg[i], p.hand_upper_deg[i]);
  }
  hand.motor = motor_of(p);
  hand.hardware.loop_feed_forward_s_per_deg = p.back_emf_Vs() / p.motor_V * std::numbers::pi / 180;
  limit(hand);
  const double duty = hand.hardware.loop_duty;
  if (duty > hand.motor.friction + hand.motor.load) return hand;
  throw io::InputError(
      "{}: motor.*: within the safe speed a motor gets {:.0f} % of its supply, and friction and load "
      "take {:.0f} %: less motor.coulomb_mNm or motor.disturbance_mNm, or more motor.gear_ratio",
      p.source, 100 * std::max(duty, 0.0), 100 * (hand.motor.friction + hand.motor.load));
}

model::Model on_hand(model::Model model, const model::Hardware& p, std::vector<std::string>& notes) {
  check_bits(model);
  const model::Wiring wiring = model::wiring_of(model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.joint[i] || !model.joints[*wiring.joint[i]].ends) continue;
    model::Joint& joint = model.joints[*wiring.joint[i]];
    const model::Ends own = *joint.ends;
    const model::Ends hand = {p.hand_lower_deg[i], p.hand_upper_deg[i]};
    const double range_deg = hand.fist_deg - hand.open_deg;
    const double off_deg =
        std::max(std::abs(own.open_deg - hand.open_deg), std::abs(own.fist_deg - hand.fist_deg));
    if (off_deg <= kSameEnds * range_deg) {
      auto& limits =
          std::get<model::Saturation>(std::ranges::find(model.blocks, joint.from, &model::Block::to)->kind);
      limits = {std::max(limits.lower_deg, hand.open_deg), std::min(limits.upper_deg, hand.fist_deg)};
      continue;
    }
    const double gain = range_deg / (own.fist_deg - own.open_deg);
    const auto map = [&](double angle_deg) { return hand.open_deg + gain * (angle_deg - own.open_deg); };
    const model::Saturation& limits = model::limits(model, joint);
    const auto [lower_deg, upper_deg] = std::minmax({map(limits.lower_deg), map(limits.upper_deg)});
    const model::Saturation within{std::max(lower_deg, hand.open_deg), std::min(upper_deg, hand.fist_deg)};
    const std::string mapped = joint.name + " on the hand";
    model.blocks.push_back({{joint.from}, mapped, model::Lti{gain, map(0), {}, {}}});
    model.blocks.push_back({{mapped}, mapped + ", limited", within});
    joint.from = mapped + ", limited";
    joint.rest_deg = map(joint.rest_deg);
    if (joint.accuracy) {
      for (double& angle_deg : joint.accuracy->angle_deg) angle_deg = map(angle_deg);
      for (double& error_deg : joint.accuracy->standard_error_deg) error_deg *= std::abs(gain);
      if (gain < 0) std::ranges::reverse(joint.accuracy->angle_deg);
      if (gain < 0) std::ranges::reverse(joint.accuracy->standard_error_deg);
    }
    joint.ends = hand;
    notes.push_back(fmt::format("{}: the model's {} deg (open) to {} (fist) become the hand's {} to {}",
                                joint.name, std::lround(own.open_deg), std::lround(own.fist_deg),
                                std::lround(hand.open_deg), std::lround(hand.fist_deg)));
  }
  model::check(model);
  return model;
}

}  // namespace flexor::deploy
