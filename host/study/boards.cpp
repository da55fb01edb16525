#include "host/study/boards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/deploy/pair_key.hpp"
#include "host/study/exact_json.hpp"
#include "host/twin/exact_json.hpp"
#include "host/twin/glove.hpp"

namespace flexor::study {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kSameEnds = 0.1;  // of the hand's range, within which a model's ends are the hand's

// Each finger's rest angle by the model; where it has no channel, the hand's lower limit.
std::array<double, kFingers> rests(const twin::Parameters& p, const model::Model& model) {
  std::array<double, kFingers> out = p.hand_lower_deg;
  const model::Wiring wiring = model::wiring_of(model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.joint[i]) continue;
    out[i] = std::clamp(model.joints[*wiring.joint[i]].rest_deg, p.hand_lower_deg[i], p.hand_upper_deg[i]);
  }
  return out;
}

// T = K_t V / R and b = K_t K_e / R + viscous, behind the gear: full speed T / b, time J / b.
deploy::HandMotor motor_of(const twin::Parameters& p) {
  constexpr double kDeg_per_rad = 180 / std::numbers::pi;
  const double kt_mNm_A = p.torque_constant_mNm_A * p.gear_ratio * p.gear_efficiency;
  const double ke_Vs = p.torque_constant_mNm_A / 1000 * p.gear_ratio;
  const double stall_mNm = kt_mNm_A * p.motor_V / p.resistance_ohm;
  const double damping_mNms = kt_mNm_A * ke_Vs / p.resistance_ohm + p.viscous_mNms_rad;
  const double inertia_mNms2 =
      (p.rotor_inertia_gcm2 * p.gear_ratio * p.gear_ratio + p.finger_inertia_gcm2) * 1e-4;
  return {stall_mNm / damping_mNms * kDeg_per_rad, inertia_mNms2 / damping_mNms, p.coulomb_mNm / stall_mNm,
          p.disturbance_mNm / stall_mNm};
}

// Finite angles of one length: what a trial of this program's own worker has.
bool is_sane(const twin::Trial& trial) {
  const std::size_t frames = trial.glove_deg[0].size();
  const auto good = [&](const std::vector<float>& angles) {
    return angles.size() == frames && std::ranges::all_of(angles, [](float a) { return std::abs(a) < 1e4F; });
  };
  return frames > 0 && std::ranges::all_of(trial.glove_deg, good) &&
         std::ranges::all_of(trial.hand_deg, good) && trial.frames_sent >= 0 && trial.frames_lost >= 0;
}

}  // namespace

deploy::Key bench_key() { return deploy::key_from_hex("000102030405060708090a0b0c0d0e0f"); }

deploy::Glove twin_glove(const twin::TrialInput& input) {
  const twin::Divider divider(input.parameters);
  const model::Wiring wiring = model::wiring_of(input.compensator);
  deploy::CalibrationDocument calibration;
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.input[i]) continue;
    const model::Input& one = input.compensator.inputs[*wiring.input[i]];
    if (one.unit == "count" || deploy::reads_alpha(one)) continue;
    calibration.unit = one.unit;
    calibration.sensor[i] = deploy::at_knots(divider.reading(one.unit, one.name));
  }
  return glove_for(input.parameters, input.compensator, calibration);
}

deploy::Glove glove_that_runs(const twin::Parameters& p, const model::Model& model,
                              const deploy::CalibrationDocument& calibration) {
  deploy::Glove glove;
  glove.model = model;
  glove.sensor =
      deploy::sensors_of(model, deploy::divider(p.divider_kohm, p.flat_kohm, p.kohm_per_deg), calibration);
  glove.baud = p.baud;
  glove.frame_rate_hz = p.frame_rate_hz;
  glove.key = bench_key();
  return glove;
}

deploy::Glove glove_for(const twin::Parameters& p, const model::Model& model,
                        const deploy::CalibrationDocument& calibration) {
  deploy::Glove glove = glove_that_runs(p, model, calibration);
  deploy::Corrected corrected = deploy::with_corrections(model, glove.sensor);
  glove.model = std::move(corrected.model);
  glove.sensor = std::move(corrected.sensor);
  return glove;
}

deploy::Hand twin_hand(const twin::Parameters& p, const model::Model& model) {
  deploy::Hand hand;
  hand.lower_deg.fill(p.loop_lower_deg);
  hand.upper_deg.fill(p.loop_upper_deg);
  hand.rest_deg = rests(p, model);
  hand.potentiometer_range_deg = p.potentiometer_range_deg;
  hand.proportional_per_deg = p.loop_proportional_per_deg;
  hand.integral_per_deg_s = p.loop_integral_per_deg_s;
  hand.integral_limit = p.loop_integral_limit;
  hand.feed_forward_s_per_deg = p.loop_feed_forward_s_per_deg;
  hand.speed_deg_s = p.loop_speed_deg_s;
  hand.duty = p.loop_duty;
  hand.baud = p.baud;
  hand.key = bench_key();
  return hand;
}

deploy::Hand safe_hand(const twin::Parameters& p, const model::Model& model) {
  deploy::Hand hand = twin_hand(p, model);
  hand.lower_deg = p.hand_lower_deg;
  hand.upper_deg = p.hand_upper_deg;
  hand.motor = motor_of(p);
  hand.feed_forward_s_per_deg =
      p.torque_constant_mNm_A / 1000 * p.gear_ratio / p.motor_V * std::numbers::pi / 180;
  return deploy::within_safe_limits(hand);
}

model::Model on_hand(model::Model model, const twin::Parameters& p, std::vector<std::string>& notes) {
  const model::Wiring wiring = model::wiring_of(model);
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!wiring.joint[i] || !model.joints[*wiring.joint[i]].ends) continue;
    model::Joint& joint = model.joints[*wiring.joint[i]];
    const model::Ends own = *joint.ends;
    const model::Ends hand = {p.hand_lower_deg[i], p.hand_upper_deg[i]};
    const double range_deg = hand.fist_deg - hand.open_deg;
    const double off_deg =
        std::max(std::abs(own.open_deg - hand.open_deg), std::abs(own.fist_deg - hand.fist_deg));
    if (off_deg <= kSameEnds * range_deg) continue;
    const double gain = range_deg / (own.fist_deg - own.open_deg);
    const auto map = [&](double angle_deg) { return hand.open_deg + gain * (angle_deg - own.open_deg); };
    const model::Saturation& limits = model::limits(model, joint);
    const auto [lower_deg, upper_deg] = std::minmax({map(limits.lower_deg), map(limits.upper_deg)});
    const std::string mapped = joint.name + " on the hand";
    model.blocks.push_back({{joint.from}, mapped, model::Lti{gain, map(0), {}, {}}});
    model.blocks.push_back({{mapped}, mapped + ", limited", model::Saturation{lower_deg, upper_deg}});
    joint.from = mapped + ", limited";
    joint.rest_deg = map(joint.rest_deg);
    joint.accuracy.reset();
    joint.ends = hand;
    notes.push_back(
        fmt::format("{}: the model's {:.0f} deg (open) to {:.0f} (fist) become the hand's {:.0f} to {:.0f}",
                    joint.name, own.open_deg, own.fist_deg, hand.open_deg, hand.fist_deg));
  }
  model::check(model);
  return model;
}

Counts gesture_counts(const twin::Parameters& p, const model::Model& model) {
  model::Model raw = compensator("raw", 1 / model.sample_period_s).model;
  for (model::Input& input : raw.inputs) input.unit = "count";
  Counts out;
  for (const twin::Motion& motion : motions("1-6")) {
    const twin::TrialInput input{p, motion, raw, 1, true};
    const twin::Trial trial = twin::simulate(input, 0, 1).front();
    for (std::size_t k = 0; k < trial.sample_s.size(); ++k) {
      std::array<int, kFingers>& counts = out.emplace_back();
      for (std::size_t i = 0; i < kFingers; ++i) counts[i] = static_cast<int>(trial.reading[i][k]);
    }
  }
  return out;
}

Boards::Boards(std::filesystem::path program) : workers_(std::move(program)) {}

std::vector<twin::Trial> Boards::simulate(const twin::TrialInput& input, std::uint64_t first,
                                          int count) const {
  const Json trials =
      workers_.run("simulate", {{"input", twin::exact_json(input)}, {"first", first}, {"count", count}});
  std::vector<twin::Trial> out;
  for (const Json& trial : trials) out.push_back(twin::trial_of(trial));
  if (out.size() != static_cast<std::size_t>(count) || !std::ranges::all_of(out, is_sane)) {
    throw io::JobError(fmt::format(
        "the boards' simulation was asked for {} trials, and not as many of finite angles came back", count));
  }
  return out;
}

GloveFigures Boards::run_glove(const deploy::Glove& glove, const Counts& counts) const {
  return glove_figures_of(workers_.run("run_glove", {{"glove", exact_json(glove)}, {"counts", counts}}));
}

HandFigures Boards::run_hand(const twin::Parameters& parameters, const deploy::Glove& glove,
                             double seconds) const {
  return hand_figures_of(workers_.run(
      "run_hand",
      {{"parameters", twin::exact_json(parameters)}, {"glove", exact_json(glove)}, {"seconds", seconds}}));
}

std::vector<Latency> Boards::latency(const twin::Parameters& parameters, const model::Model& model, int edges,
                                     std::uint64_t seed) const {
  const Json stages = workers_.run("latency", {{"parameters", twin::exact_json(parameters)},
                                               {"model", Json::parse(model::to_json(model))},
                                               {"edges", edges},
                                               {"seed", seed}});
  return stages.get<std::vector<Latency>>();
}

}  // namespace flexor::study
