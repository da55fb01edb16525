#include "host/twin/simulation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>

#include "host/io/io.hpp"
#include "host/model/correction.hpp"
#include "host/model/wiring.hpp"
#include "host/twin/glove.hpp"
#include "host/twin/laboratory.hpp"
#include "host/twin/plant.hpp"
#include "host/twin/radio.hpp"
#include "host/twin/random.hpp"
#include "host/twin/world.hpp"

namespace flexor::twin {
namespace {

// The compensator's joint for each finger, all of which the hand has.
model::Wiring full_wiring(const model::Model& compensator) {
  model::Wiring out = model::wiring_of(compensator);
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!out.joint[i]) missing.push_back(model::finger_names()[i]);
  }
  if (!missing.empty()) {
    std::vector<std::string> has;
    for (const model::Joint& joint : compensator.joints) has.push_back(joint.name);
    throw io::InputError(
        fmt::format("compensator {}: the hand has a motor for {}, the model only joint(s) {}",
                    compensator.name, fmt::join(missing, ", "), fmt::join(has, ", ")));
  }
  return out;
}

// The glove of a trial: what its strips read, and its chain. A recalibration lies in the table of counts, as on the board.
struct Glove {
  model::Sensors reading;  // in the unit of the strip's input, alpha where it feeds none
  model::ChainParts parts;
};

Glove glove_of(const TrialInput& input) {
  const Divider divider(input.parameters);
  const model::Wiring wiring = full_wiring(input.compensator);
  const model::Folded folded = model::folded(input.compensator);
  model::Sensors reading;
  model::Sensors made;
  std::array<glove::TrackedStrip, kFingers> tracked{};
  for (std::size_t i = 0; i < kFingers; ++i) {
    reading[i] = divider.reading("deg", "");
    if (!wiring.input[i]) continue;
    const model::Input& one = input.compensator.inputs[*wiring.input[i]];
    const model::Correction& correction = folded.correction[*wiring.input[i]];
    reading[i] = divider.reading(one.unit, one.name);
    made[i] = [correction, raw = reading[i]](double counts) { return correction(raw(counts)); };
    if (!input.tracking || !input.tracking->strip[i]) continue;
    model::TrackedRange range = *input.tracking->strip[i];
    range.poses = {correction(range.poses.open), correction(range.poses.fist)};
    tracked[i] = model::tracked_strip<glove::Tracking>(range, {});
  }
  return {std::move(reading),
          {model::glove_tables(folded.model, made), model::HostCompensator(folded.model), tracked,
           model::samples_per_tick(input.compensator.sample_period_s)}};
}

constexpr double kOn_s = 1;  // how long the glove has been on: the guard takes 0.9 s through 180 degrees

// kTrials trials side by side; lane = finger * kTrials + trial.
template <int kTrials>
class Batch {  // NOLINT(clang-analyzer-optin.performance.Padding): one of them, a hundred kilobytes
 public:
  Batch(const TrialInput& input, std::uint64_t first, int count)
      : input_(input),
        p_(input.parameters),
        constants_(p_),
        divider_(p_),
        glove_(glove_of(input)),
        period_s_(input.compensator.sample_period_s),
        frame_every_s_(p_.frame_rate_hz > 0 ? 1 / p_.frame_rate_hz : 0),
        count_(count),
        end_ms_(std::lround(input.motion.duration_s() * 1000)),
        frames_(static_cast<std::size_t>(input.motion.duration_s() * p_.camera_rate_hz) + 1) {
    for (int t = 0; t < kTrials; ++t) begin_trial(t, first + static_cast<std::uint64_t>(t));
    if (input.worn) wear(*input.worn);
    for (int lane = 0; lane < kLanes; ++lane) begin_lane(lane, input.motion);
    hand_next_ms_ = frame_ms(0, p_.camera_rate_hz, p_.hand_camera_latency_s);
    glove_next_ms_ = frame_ms(0, p_.camera_rate_hz, p_.glove_camera_latency_s);
  }

  std::vector<Trial> run() {
    // Cameras look at what was there a latency ago: their last frame is taken before the end.
    for (std::int64_t now = -kWarmUp_ms; now <= end_ms_; ++now) {
      if ((now + kWarmUp_ms) % kBlock_ms == 0) begin_block(now);
      for (int t = 0; t < kTrials; ++t) {
        if (now >= next_sample_ms_[at(t)]) sample(t, now);
        if (now >= radio_[at(t)].next_arrival_ms()) deliver(t, now);
      }
      advance(constants_, x_);
      look(now);
    }
    finish();
    trials_.resize(static_cast<std::size_t>(count_));
    return std::move(trials_);
  }

  // Of each lane.
  const std::vector<double>& worn(int lane) const { return worn_[at(lane)]; }

 private:
  static constexpr int kLanes = kFingers * kTrials;
  using Counts = std::array<int, kFingers>;
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  void begin_trial(int t, std::uint64_t number) {
    const std::uint64_t seed = seed_of(input_.seed, number);
    variation_[at(t)] = draw_variation(p_, seed);
    chain_.emplace_back(glove_.parts);
    radio_[at(t)] = Radio(p_, seed_of(seed, Purpose::radio));
    Random phase(seed_of(seed, Purpose::phase));
    first_sample_s_[at(t)] = -static_cast<double>(kWarmUp_ms) / 1000 + period_s_ * phase.uniform();
    next_sample_ms_[at(t)] = std::lround(first_sample_s_[at(t)] * 1000);
    next_frame_s_[at(t)] = -1e9;
    camera_noise_[at(t)] = Random(seed_of(seed, Purpose::camera));
    for (int i = 0; i < kFingers; ++i) {
      const int lane = i * kTrials + t;
      strip_[at(lane)] = Strip(p_, i, period_s_, seed_of(seed, Purpose::sensor, i));
      disturbance_[at(lane)] = Disturbance(p_, seed_of(seed, Purpose::disturbance, i));
      x_.noise[lane] = static_cast<std::uint32_t>(seed_of(seed, Purpose::potentiometer, i)) | 1U;
    }
    Trial& trial = trials_.emplace_back();
    if (t >= count_) return;
    for (std::size_t i = 0; i < kFingers; ++i) {
      trial.glove_deg[i].reserve(frames_);
      trial.hand_deg[i].reserve(frames_);
    }
  }

  // At rest in the first pose, the hand already there.
  void begin_lane(int lane, const Motion& motion) {
    const int finger = lane / kTrials;
    const auto i = at(finger);
    const double start = motion.angle(finger, -1, variation_[at(lane % kTrials)]);
    const auto rho = static_cast<float>(start);
    x_.reference[lane] = x_.slipped[lane] = x_.visco[lane] = x_.creep[lane] = rho;
    x_.lower[lane] = static_cast<float>(p_.hand_lower_deg[i]);
    x_.upper[lane] = static_cast<float>(p_.hand_upper_deg[i]);
    x_.motor[lane] = x_.joint[lane] = std::clamp(rho, x_.lower[lane], x_.upper[lane]);
    x_.command[lane] = static_cast<std::int32_t>(std::lround(16 * x_.joint[lane]));
    x_.setpoint[lane] = x_.command[lane] << 16;
    total_error_[at(lane)] = 0;
    reference_[at(lane)] = start;
  }

  // What the glove's own side goes through before the trial: cloth, strips and trackers. The hand is off.
  void wear(const Worn& worn) {
    const PlantState<kLanes> before = x_;
    for (int lane = 0; lane < kLanes; ++lane) {
      begin_lane(lane, worn.motion);
      strip_[at(lane)].wear(worn.duration_s, worn.drift_turns_s);
    }
    const auto lasts_ms = static_cast<std::int64_t>(worn.duration_s * 1000);
    const auto period_ms = static_cast<std::int64_t>(std::max(1.0, std::round(period_s_ * 1000)));
    const auto again_ms = static_cast<std::int64_t>(worn.motion.duration_s() * 1000);
    for (std::int64_t now = 0; now < lasts_ms; ++now) {
      if (now % kBlock_ms == 0) move(worn.motion, now % again_ms);
      for (int t = 0; now % period_ms == 0 && t < kTrials; ++t) {
        const Counts counts = read(t, static_cast<double>(now - lasts_ms) / 1000);
        for (int i = 0; i < kFingers; ++i)
          worn_[at(i * kTrials + t)].push_back(glove_.reading[at(i)](counts[at(i)]));
        if (input_.tracking) chain_[at(t)].step(counts);
      }
      advance(constants_, x_);
    }
    x_ = before;
  }

  // References of the next block.
  void move(const Motion& motion, std::int64_t now) {
    const double next_s = static_cast<double>(now + kBlock_ms) / 1000;
    for (int lane = 0; lane < kLanes; ++lane) {
      const double rho = motion.angle(lane / kTrials, next_s, variation_[at(lane % kTrials)]);
      x_.reference[lane] = static_cast<float>(reference_[at(lane)]);
      x_.reference_slope[lane] = static_cast<float>((rho - reference_[at(lane)]) / kBlock_ms);
      reference_[at(lane)] = rho;
    }
  }

  Counts read(int t, double now_s) {
    Counts out{};
    for (int i = 0; i < kFingers; ++i) {
      const int lane = i * kTrials + t;
      out[at(i)] = strip_[at(lane)].sample(divider_, now_s, static_cast<double>(bend(constants_, x_, lane)));
    }
    return out;
  }

  void begin_block(std::int64_t now) {
    move(input_.motion, now);
    for (int lane = 0; lane < kLanes; ++lane) {
      x_.disturbance[lane] = static_cast<float>(disturbance_[at(lane)].next());
      if (now > 0) total_error_[at(lane)] += static_cast<double>(x_.error_deg_ms[lane]);
      x_.error_deg_ms[lane] = 0;
      if (now == 0) forget_stops(x_, lane);
    }
  }

  void sample(int t, std::int64_t now) {
    const double now_s = static_cast<double>(now) / 1000;
    const std::int64_t k = ++samples_[at(t)];
    next_sample_ms_[at(t)] =
        std::lround((first_sample_s_[at(t)] + static_cast<double>(k) * period_s_) * 1000);
    const Counts counts = read(t, now_s);
    // Switched on well before: the guard has brought the fingers from rest to where they are.
    for (double on_s = 0; k == 1 && on_s < kOn_s; on_s += period_s_) chain_[at(t)].step(counts);
    const FrameAngles angles = std::to_array(chain_[at(t)].step(counts).angle);
    if (input_.record_samples) record(t, now_s, counts, angles);
    // A frame rate below the sample rate sends every so many samples, the newest of them.
    double& due_s = next_frame_s_[at(t)];
    if (now_s + period_s_ / 2 < due_s) return;
    due_s = due_s + 2 * frame_every_s_ < now_s ? now_s + frame_every_s_ : due_s + frame_every_s_;
    radio_[at(t)].send(now, angles);
  }

  void record(int t, double now_s, const Counts& counts, const FrameAngles& angles) {
    Trial& trial = trials_[at(t)];
    trial.sample_s.push_back(now_s);
    for (int i = 0; i < kFingers; ++i) {
      trial.reading[at(i)].push_back(glove_.reading[at(i)](counts[at(i)]));
      trial.beta_deg[at(i)].push_back(angles[at(i)] / 16.0);
      trial.true_deg[at(i)].push_back(static_cast<double>(x_.reference[i * kTrials + t]));
    }
  }

  void deliver(int t, std::int64_t now) {
    const FrameAngles* angles = radio_[at(t)].receive(now);
    if (angles == nullptr) return;
    for (int i = 0; i < kFingers; ++i) x_.command[i * kTrials + t] = (*angles)[at(i)];
    if (!settled_[at(t)]) settle(t);
  }

  // The hand had been in the first pose for rest_s: where the command lies behind an end stop, its loop has
  // wound up.
  void settle(int t) {
    settled_[at(t)] = true;
    const hand::LoopSettings& c = constants_.loop;
    for (int lane = t; lane < kLanes; lane += kTrials) {
      x_.integral[lane] = settled_integral(c, p_.rest_s, x_.command[lane], x_.lower[lane], x_.upper[lane]);
    }
  }

  void look(std::int64_t now) {
    if (now >= glove_next_ms_ && glove_frame_ < frames_) {
      shoot(&Trial::glove_deg, x_.reference);
      glove_next_ms_ = frame_ms(++glove_frame_, p_.camera_rate_hz, p_.glove_camera_latency_s);
    }
    if (now >= hand_next_ms_ && hand_frame_ < frames_) {
      shoot(&Trial::hand_deg, x_.joint);
      hand_next_ms_ = frame_ms(++hand_frame_, p_.camera_rate_hz, p_.hand_camera_latency_s);
    }
  }

  void shoot(std::array<std::vector<float>, kFingers> Trial::*view, const float* angle) {
    for (int t = 0; t < count_; ++t) {
      for (int i = 0; i < kFingers; ++i) {
        const double noise = p_.camera_noise_deg * camera_noise_[at(t)].normal();
        (trials_[at(t)].*view)[at(i)].push_back(angle[i * kTrials + t] + static_cast<float>(noise));
      }
    }
  }

  void finish() {
    for (int t = 0; t < kTrials; ++t) {
      Trial& trial = trials_[at(t)];
      trial.frames_sent = radio_[at(t)].sent();
      trial.frames_lost = settled_[at(t)] ? radio_[at(t)].lost() : radio_[at(t)].sent();
      for (int i = 0; i < kFingers; ++i) {
        const int lane = i * kTrials + t;
        trial.error_deg_s[at(i)] =
            (total_error_[at(lane)] + static_cast<double>(x_.error_deg_ms[lane])) / 1000;
        trial.impacts[at(i)] = x_.impacts[lane];
        trial.impact_deg_s[at(i)] = static_cast<double>(x_.impact_deg_s[lane]);
        trial.pressed_s[at(i)] = x_.pressed_ms[lane] * kStep_s;
      }
    }
  }

  const TrialInput& input_;
  const Parameters& p_;
  PlantConstants constants_;
  Divider divider_;
  Glove glove_;
  double period_s_;
  double frame_every_s_;
  int count_;
  std::int64_t end_ms_;
  std::size_t frames_;

  PlantState<kLanes> x_{};
  std::array<double, kLanes> reference_{};
  std::array<double, kLanes> total_error_{};
  std::array<Strip, kLanes> strip_;
  std::array<std::vector<double>, kLanes> worn_;
  std::array<Disturbance, kLanes> disturbance_;
  std::array<Variation, kTrials> variation_;
  std::array<Radio, kTrials> radio_;
  std::array<Random, kTrials> camera_noise_;
  std::array<double, kTrials> first_sample_s_{};
  std::array<std::int64_t, kTrials> next_sample_ms_{};
  std::array<std::int64_t, kTrials> samples_{};
  std::array<double, kTrials> next_frame_s_{};
  std::array<bool, kTrials> settled_{};
  std::deque<model::HostChain> chain_;
  std::vector<Trial> trials_;
  std::size_t glove_frame_ = 0;
  std::size_t hand_frame_ = 0;
  std::int64_t glove_next_ms_ = 0;
  std::int64_t hand_next_ms_ = 0;
};

}  // namespace

void check(const TrialInput& input) {
  check(input.parameters);
  (void)glove_of(input);
  const double rate_hz = 1 / input.compensator.sample_period_s;
  if (!(rate_hz >= 0.1 && rate_hz <= kMaxRate_hz * (1 + 1e-9))) {
    throw io::InputError(
        fmt::format("a rate of {:g} Hz is impossible: the twin's plant runs at {:g} Hz, and the slowest "
                    "glove at 0.1 Hz",
                    rate_hz, kMaxRate_hz));
  }
  const Parameters& p = input.parameters;
  const double pictures = input.motion.duration_s() * p.camera_rate_hz;
  if (pictures > kMaxPictures) {
    throw io::InputError(
        fmt::format("motion {}: {:g} s at {:g} pictures a second are more than {}: set camera.rate_hz to at "
                    "most {:.0f}, or play a shorter one",
                    input.motion.name(), input.motion.duration_s(), p.camera_rate_hz, kMaxPictures,
                    std::floor(kMaxPictures / input.motion.duration_s())));
  }
  const double frames_hz = p.frame_rate_hz > 0 ? std::min(p.frame_rate_hz, rate_hz) : rate_hz;
  const double airtime_s = p.frame_bytes * 10 / p.baud;
  if (frames_hz * airtime_s > 1) {
    throw io::InputError(
        fmt::format("{:g} frames of {:g} bytes a second do not fit {:g} baud: set radio.frame_rate_hz to at "
                    "most {:.0f}, or "
                    "raise radio.baud",
                    frames_hz, p.frame_bytes, p.baud, std::floor(1 / airtime_s)));
  }
}

model::ChainParts glove_chain(const TrialInput& input) { return glove_of(input).parts; }

std::vector<Trial> simulate(const TrialInput& input, std::uint64_t first, int count) {
  // Half as many lanes take half the time.
  constexpr int kHalf = kTrialsAtOnce / 2;
  if (count <= kHalf) return std::make_unique<Batch<kHalf>>(input, first, count)->run();
  return std::make_unique<Batch<kTrialsAtOnce>>(input, first, count)->run();
}

std::vector<Trial> simulate_scalar(const TrialInput& input, std::uint64_t first, int count) {
  std::vector<Trial> out;
  for (int t = 0; t < count; ++t) {
    out.push_back(std::make_unique<Batch<1>>(input, first + static_cast<std::uint64_t>(t), 1)->run().front());
  }
  return out;
}

std::array<std::vector<double>, kFingers> worn_readings(const TrialInput& input, std::uint64_t trial) {
  const auto batch = std::make_unique<Batch<1>>(input, trial, 1);
  std::array<std::vector<double>, kFingers> out;
  for (int i = 0; i < kFingers; ++i) out[static_cast<std::size_t>(i)] = batch->worn(i);
  return out;
}

Posture posture(int finger, double mcp_deg) {
  if (finger == 0) return {mcp_deg, mcp_deg / 2, 0};
  return {mcp_deg, mcp_deg * 3 / 4, mcp_deg * 2 / 3};
}

}  // namespace flexor::twin
