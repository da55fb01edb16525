// Trials side by side with the electronics left out: persons, sensors in their cloth, what pushes the motors, cameras. simulate() puts
// the runtime's chain and loops in between, world.hpp whoever reads and drives. One lane is one finger of one trial:
// lane = finger * kTrials + trial.
#pragma once

#include <algorithm>
#include <cmath>

#include "host/twin/laboratory.hpp"
#include "host/twin/plant.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::twin {

template <int kTrials>
struct Lanes {
  static constexpr int kLanes = kFingers * kTrials;
  using View = std::array<std::vector<float>, kFingers>;
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  // Trials from `first` on, of which cameras see `seen`; `played` outlives them.
  Lanes(const TrialInput& played, std::uint64_t first, int seen)
      : input(played),
        p(played.parameters),
        constants(p),
        divider(p),
        count(seen),
        end_ms(std::lround(played.motion.duration_s() * 1000)) {
    film(0, played.motion.duration_s());
    for (int t = 0; t < kTrials; ++t)
      begin_trial(t, seed_of(input.seed, first + static_cast<std::uint64_t>(t)));
    for (int lane = 0; lane < kLanes; ++lane) begin_lane(lane, input.motion);
  }

  // At rest in the first pose, the hand already there.
  void begin_lane(int lane, const Motion& motion) {
    const int finger = lane / kTrials;
    const double start = motion.angle(finger, -1, variation[at(lane % kTrials)]);
    const auto rho = static_cast<float>(start);
    x.reference[lane] = x.slipped[lane] = x.visco[lane] = x.creep[lane] = rho;
    x.lower[lane] = static_cast<float>(p.hand_lower_deg[at(finger)]);
    x.upper[lane] = static_cast<float>(p.hand_upper_deg[at(finger)]);
    x.motor[lane] = x.joint[lane] = std::clamp(rho, x.lower[lane], x.upper[lane]);
    x.command[lane] = static_cast<std::int32_t>(std::lround(16 * x.joint[lane]));
    x.setpoint[lane] = x.command[lane] << 16;
    total_error[at(lane)] = 0;
    reference[at(lane)] = start;
  }

  double angle(const Motion& motion, int lane, std::int64_t t_ms) const {
    return motion.angle(lane / kTrials, static_cast<double>(t_ms) / 1000, variation[at(lane % kTrials)]);
  }

  // References of the next block: angle_at(lane, t_ms) is where it ends.
  template <class AngleAt>
  void move(std::int64_t now_ms, const AngleAt& angle_at) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const double rho = angle_at(lane, now_ms + kBlock_ms);
      x.reference[lane] = static_cast<float>(reference[at(lane)]);
      x.reference_slope[lane] = static_cast<float>((rho - reference[at(lane)]) / kBlock_ms);
      reference[at(lane)] = rho;
    }
  }

  template <class AngleAt>
  void begin_block(std::int64_t now_ms, const AngleAt& angle_at) {
    move(now_ms, angle_at);
    for (int lane = 0; lane < kLanes; ++lane) {
      // A world starts earlier than simulate(): its draws begin there.
      if (now_ms >= -kWarmUp_ms) x.disturbance[lane] = static_cast<float>(disturbance[at(lane)].next());
      if (now_ms > 0) total_error[at(lane)] += static_cast<double>(x.error_deg_ms[lane]);
      x.error_deg_ms[lane] = 0;
      if (now_ms != 0) continue;
      x.impact_deg_s[lane] = 0;  // what happened at the end stops before a recording starts does not count
      x.impacts[lane] = x.pressed_ms[lane] = 0;
    }
  }

  // ADC counts; one call a sample and lane.
  int sample(int lane, double t_s) { return sensor[at(lane)].sample(divider, t_s, felt_deg(lane)); }

  // The cameras begin again: what lasts so long from `start_ms` on.
  void film(std::int64_t start_ms, double duration_s) {
    film_ms = start_ms;
    frames = static_cast<std::size_t>(duration_s * p.camera_rate_hz) + 1;
    glove_frame = hand_frame = 0;
    glove_next_ms = frame_ms(0, p.camera_rate_hz, p.glove_camera_latency_s);
    hand_next_ms = frame_ms(0, p.camera_rate_hz, p.hand_camera_latency_s);
    trials.assign(kTrials, {});
  }

  // Cameras look at what was there a latency ago.
  void look(std::int64_t now_ms) {
    now_ms -= film_ms;
    if (now_ms >= glove_next_ms && glove_frame < frames) {
      shoot(&Trial::glove_deg, x.reference);
      glove_next_ms = frame_ms(++glove_frame, p.camera_rate_hz, p.glove_camera_latency_s);
    }
    if (now_ms >= hand_next_ms && hand_frame < frames) {
      shoot(&Trial::hand_deg, x.joint);
      hand_next_ms = frame_ms(++hand_frame, p.camera_rate_hz, p.hand_camera_latency_s);
    }
  }

  // Of the loop after person.rest_s of this command in the first pose: behind an end stop it has wound up.
  std::int32_t settled_integral(int lane, std::int32_t command_q4) const {
    const hand::LoopSettings& c = constants.loop;
    const float command_deg = static_cast<float>(std::clamp<std::int32_t>(command_q4, c.lower, c.upper)) / 16;
    const float behind_deg = command_deg - std::clamp(command_deg, x.lower[lane], x.upper[lane]);
    const double integral =
        static_cast<double>(c.integral) * static_cast<double>(behind_deg) * p.rest_s / kStep_s;
    const double limit = c.integral_limit;
    return static_cast<std::int32_t>(std::clamp(integral, -limit, limit));
  }

  // What the cameras saw, and what the hand went through.
  std::vector<Trial> finish() {
    for (int lane = 0; lane < kLanes; ++lane) {
      Trial& trial = trials[at(lane % kTrials)];
      const std::size_t i = at(lane / kTrials);
      trial.error_deg_s[i] = (total_error[at(lane)] + static_cast<double>(x.error_deg_ms[lane])) / 1000;
      trial.impacts[i] = x.impacts[lane];
      trial.impact_deg_s[i] = static_cast<double>(x.impact_deg_s[lane]);
      trial.pressed_s[i] = x.pressed_ms[lane] * kStep_s;
    }
    return std::move(trials);
  }

  const TrialInput& input;
  const Parameters& p;
  PlantConstants constants;
  Divider divider;
  int count;
  std::int64_t end_ms;
  std::size_t frames;

  PlantState<kLanes> x{};
  std::array<double, kLanes> reference{};
  std::array<double, kLanes> total_error{};
  std::array<Sensor, kLanes> sensor;
  std::array<Disturbance, kLanes> disturbance;
  std::array<Variation, kTrials> variation;
  std::array<Random, kTrials> camera_noise;
  std::array<double, kTrials> phase_s{};  // of the first sample, within a period
  std::vector<Trial> trials;
  std::size_t glove_frame;
  std::size_t hand_frame;
  std::int64_t film_ms;  // the cameras' t = 0
  std::int64_t glove_next_ms;
  std::int64_t hand_next_ms;

 private:
  void begin_trial(int t, std::uint64_t seed) {
    const double period_s = input.compensator.sample_period_s;
    variation[at(t)] = draw_variation(p, seed);
    phase_s[at(t)] = period_s * Random(seed_of(seed, Purpose::phase)).uniform();
    camera_noise[at(t)] = Random(seed_of(seed, Purpose::camera));
    for (int i = 0; i < kFingers; ++i) {
      const int lane = i * kTrials + t;
      sensor[at(lane)] = Sensor(p, i, period_s, seed_of(seed, Purpose::sensor, i));
      disturbance[at(lane)] = Disturbance(p, seed_of(seed, Purpose::disturbance, i));
      x.noise[lane] = static_cast<std::uint32_t>(seed_of(seed, Purpose::potentiometer, i)) | 1U;
    }
    for (View Trial::*view : {&Trial::glove_deg, &Trial::hand_deg}) {
      for (auto& finger : trials[at(t)].*view) finger.reserve(t < count ? frames : 0);
    }
  }

  // A finger's bend in its range: 0 at the lower limit, 1 at the upper one.
  double share(int lane) const {
    return static_cast<double>((bend(constants, x, lane) - x.lower[lane]) / (x.upper[lane] - x.lower[lane]));
  }

  // What the sensor of finger i feels, r_i = share: r_i + c_(i-1) r_(i-1) + c_i r_(i+1), back in degrees. c_0, between thumb and
  // index, is cloth.thumb_share, the others are cloth.neighbour_share.
  double felt_deg(int lane) const {
    double felt = share(lane);
    for (const int other : {lane - kTrials, lane + kTrials}) {
      if (other < 0 || other >= kLanes) continue;
      felt += (std::min(lane, other) < kTrials ? p.thumb_share : p.neighbour_share) * share(other);
    }
    return static_cast<double>(x.lower[lane]) + felt * static_cast<double>(x.upper[lane] - x.lower[lane]);
  }

  void shoot(View Trial::*view, const float* seen_deg) {
    for (int t = 0; t < count; ++t) {
      for (int i = 0; i < kFingers; ++i) {
        const double noise = p.camera_noise_deg * camera_noise[at(t)].normal();
        (trials[at(t)].*view)[at(i)].push_back(seen_deg[i * kTrials + t] + static_cast<float>(noise));
      }
    }
  }
};

}  // namespace flexor::twin
