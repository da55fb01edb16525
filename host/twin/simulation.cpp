#include "host/twin/simulation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <utility>

#include "host/io/io.hpp"
#include "host/model/correction.hpp"
#include "host/model/wiring.hpp"
#include "host/twin/glove.hpp"
#include "host/twin/lanes.hpp"
#include "host/twin/radio.hpp"

namespace flexor::twin {
namespace {

// The compensator's joint for each finger, all of which the hand has.
model::Wiring full_wiring(const model::Model& compensator) {
  const std::vector<std::string> missing = model::missing_fingers(compensator);
  if (missing.empty()) return model::wiring_of(compensator);
  std::vector<std::string> has;
  for (const model::Joint& joint : compensator.joints) has.push_back(joint.name);
  throw io::InputError("compensator {}: the hand has a motor for {}, the model only joint(s) {}",
                       compensator.name, fmt::join(missing, ", "), fmt::join(has, ", "));
}

// The glove of a trial: what its sensors read, and its chain. A recalibration lies in the table of counts, as on the board.
struct Glove {
  model::Sensors reading;  // in the unit of the sensor's input, alpha where it feeds none
  model::ChainParts parts;
};

Glove glove_of(const TrialInput& input) {
  const Divider divider(input.parameters);
  const model::Wiring wiring = full_wiring(input.compensator);
  const model::Folded folded = model::folded(input.compensator);
  model::Sensors reading;
  model::Sensors made;
  std::array<glove::TrackedSensor, kFingers> tracked{};
  for (std::size_t i = 0; i < kFingers; ++i) {
    reading[i] = divider.reading("deg", "");
    if (!wiring.input[i]) continue;
    const model::Input& one = input.compensator.inputs[*wiring.input[i]];
    const model::Correction& correction = folded.correction[*wiring.input[i]];
    reading[i] = divider.reading(one.unit, one.name);
    made[i] = [correction, raw = reading[i]](double counts) { return correction(raw(counts)); };
    if (!input.tracking || !input.tracking->sensor[i]) continue;
    model::TrackedRange range = *input.tracking->sensor[i];
    range.poses = {correction(range.poses.open), correction(range.poses.fist)};
    tracked[i] = model::tracked_from<glove::Tracking>(range, {});
  }
  return {std::move(reading),
          {model::glove_tables(folded.model, made), model::HostCompensator(folded.model), tracked,
           model::samples_per_tick(input.compensator.sample_period_s)}};
}

constexpr double kOn_s = 1;  // how long the glove has been on: the guard takes 0.9 s through 180 degrees

template <int kTrials>
class Batch {  // NOLINT(clang-analyzer-optin.performance.Padding): one of them, a hundred kilobytes
 public:
  Batch(const TrialInput& input, std::uint64_t first, int count)
      : lanes_(input, first, count),
        glove_(glove_of(input)),
        period_s_(input.compensator.sample_period_s),
        frame_every_s_(input.parameters.frame_rate_hz > 0 ? 1 / input.parameters.frame_rate_hz : 0) {
    for (int t = 0; t < kTrials; ++t) {
      const std::uint64_t seed = seed_of(input.seed, first + static_cast<std::uint64_t>(t));
      chain_.emplace_back(glove_.parts);
      radio_[at(t)] = Radio(input.parameters, seed_of(seed, Purpose::radio));
      first_sample_s_[at(t)] = -static_cast<double>(kWarmUp_ms) / 1000 + lanes_.phase_s[at(t)];
      next_sample_ms_[at(t)] = std::lround(first_sample_s_[at(t)] * 1000);
      next_frame_s_[at(t)] = -1e9;
    }
    if (input.worn) wear(*input.worn);
  }

  std::vector<Trial> run() {
    // Cameras look at what was there a latency ago: their last frame is taken before the end.
    for (std::int64_t now = -kWarmUp_ms; now <= lanes_.end_ms; ++now) {
      if ((now + kWarmUp_ms) % kBlock_ms == 0) lanes_.begin_block(now, angle_of(lanes_.input.motion));
      for (int t = 0; t < kTrials; ++t) {
        if (now >= next_sample_ms_[at(t)]) sample(t, now);
        if (now >= radio_[at(t)].next_arrival_ms()) deliver(t, now);
      }
      advance(lanes_.constants, lanes_.x);
      lanes_.look(now);
    }
    std::vector<Trial> out = lanes_.finish();
    for (int t = 0; t < kTrials; ++t) {
      out[at(t)].frames_sent = radio_[at(t)].sent();
      out[at(t)].frames_lost = settled_[at(t)] ? radio_[at(t)].lost() : radio_[at(t)].sent();
    }
    out.resize(at(lanes_.count));
    return out;
  }

  // Of each lane.
  const std::vector<double>& worn(int lane) const { return worn_[at(lane)]; }

 private:
  static constexpr int kLanes = Lanes<kTrials>::kLanes;
  using Counts = std::array<int, kFingers>;
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  auto angle_of(const Motion& motion) const {
    return [this, &motion](int lane, std::int64_t t_ms) { return lanes_.angle(motion, lane, t_ms); };
  }

  // What the glove's own side goes through before the trial: cloth, sensors and trackers. The hand is off.
  void wear(const Worn& worn) {
    const PlantState<kLanes> before = lanes_.x;
    for (int lane = 0; lane < kLanes; ++lane) {
      lanes_.begin_lane(lane, worn.motion);
      lanes_.sensor[at(lane)].wear(worn.duration_s, worn.drift_turns_s);
    }
    const auto lasts_ms = static_cast<std::int64_t>(worn.duration_s * 1000);
    const auto period_ms = static_cast<std::int64_t>(std::max(1.0, std::round(period_s_ * 1000)));
    const auto again_ms = static_cast<std::int64_t>(worn.motion.duration_s() * 1000);
    for (std::int64_t now = 0; now < lasts_ms; ++now) {
      if (now % kBlock_ms == 0) lanes_.move(now % again_ms, angle_of(worn.motion));
      for (int t = 0; now % period_ms == 0 && t < kTrials; ++t) {
        const Counts counts = read(t, static_cast<double>(now - lasts_ms) / 1000);
        for (int i = 0; i < kFingers; ++i)
          worn_[at(i * kTrials + t)].push_back(glove_.reading[at(i)](counts[at(i)]));
        if (lanes_.input.tracking) chain_[at(t)].step(counts);
      }
      advance(lanes_.constants, lanes_.x);
    }
    lanes_.x = before;
    for (int lane = 0; lane < kLanes; ++lane) lanes_.begin_lane(lane, lanes_.input.motion);
  }

  Counts read(int t, double now_s) {
    Counts out{};
    for (int i = 0; i < kFingers; ++i) out[at(i)] = lanes_.sample(i * kTrials + t, now_s);
    return out;
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
    if (lanes_.input.record_samples) record(t, now_s, counts, angles);
    // A frame rate below the sample rate sends every so many samples, the newest of them.
    double& due_s = next_frame_s_[at(t)];
    if (now_s + period_s_ / 2 < due_s) return;
    due_s = due_s + 2 * frame_every_s_ < now_s ? now_s + frame_every_s_ : due_s + frame_every_s_;
    radio_[at(t)].send(now, angles);
  }

  void record(int t, double now_s, const Counts& counts, const FrameAngles& angles) {
    Trial& trial = lanes_.trials[at(t)];
    trial.sample_s.push_back(now_s);
    for (int i = 0; i < kFingers; ++i) {
      trial.reading[at(i)].push_back(glove_.reading[at(i)](counts[at(i)]));
      trial.beta_deg[at(i)].push_back(angles[at(i)] / 16.0);
      trial.true_deg[at(i)].push_back(static_cast<double>(lanes_.x.reference[i * kTrials + t]));
    }
  }

  void deliver(int t, std::int64_t now) {
    const FrameAngles* angles = radio_[at(t)].receive(now);
    if (angles == nullptr) return;
    for (int i = 0; i < kFingers; ++i) lanes_.x.command[i * kTrials + t] = (*angles)[at(i)];
    if (std::exchange(settled_[at(t)], true)) return;
    for (int lane = t; lane < kLanes; lane += kTrials)
      lanes_.x.integral[lane] = lanes_.settled_integral(lane, lanes_.x.command[lane]);
  }

  Lanes<kTrials> lanes_;
  Glove glove_;
  double period_s_;
  double frame_every_s_;
  std::array<std::vector<double>, kLanes> worn_;
  std::array<Radio, kTrials> radio_;
  std::array<double, kTrials> first_sample_s_{};
  std::array<std::int64_t, kTrials> next_sample_ms_{};
  std::array<std::int64_t, kTrials> samples_{};
  std::array<double, kTrials> next_frame_s_{};
  std::array<bool, kTrials> settled_{};
  std::deque<model::HostChain> chain_;
};

}  // namespace

void check(const TrialInput& input) {
  check(input.parameters);
  (void)glove_of(input);
  const double rate_hz = 1 / input.compensator.sample_period_s;
  if (!(rate_hz >= 0.1 && rate_hz <= kMaxRate_hz * (1 + 1e-9))) {
    throw io::InputError(
        "a rate of {:g} Hz is impossible: the twin's plant runs at {:g} Hz, and the slowest glove at 0.1 Hz",
        rate_hz, kMaxRate_hz);
  }
  const Parameters& p = input.parameters;
  const double pictures = input.motion.duration_s() * p.camera_rate_hz;
  if (pictures > kMaxPictures) {
    throw io::InputError(
        "motion {}: {:g} s at {:g} pictures a second are more than {}: set camera.rate_hz to at "
        "most {:.0f}, or play a shorter one",
        input.motion.name(), input.motion.duration_s(), p.camera_rate_hz, kMaxPictures,
        std::floor(kMaxPictures / input.motion.duration_s()));
  }
  const double frames_hz = p.frame_rate_hz > 0 ? std::min(p.frame_rate_hz, rate_hz) : rate_hz;
  const double airtime_s = p.frame_bytes * 10 / p.baud;
  if (frames_hz * airtime_s > 1) {
    throw io::InputError(
        "{:g} frames of {:g} bytes a second do not fit {:g} baud: set radio.frame_rate_hz to at "
        "most {:.0f}, or raise radio.baud",
        frames_hz, p.frame_bytes, p.baud, std::floor(1 / airtime_s));
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
