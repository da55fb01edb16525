// The glove's signal chain on a PC: the yardstick for what the board sends, to the bit.
#pragma once

#include "host/deploy/config.hpp"
#include "host/model/compensator.hpp"
#include "host/model/formats.hpp"
#include "host/model/tracking.hpp"
#include "runtime/glove/signal_chain.hpp"

namespace flexor::deploy {

class HostCompensator {
 public:
  // `more`: joints of the model whose angles follow the fingers'.
  explicit HostCompensator(const model::Model& model, const std::vector<VrJoint>& more)
      : angle(kFingers + more.size()),
        compensator_(model),
        wiring_(model::wiring_of(model)),
        more_(more),
        reading_(model.inputs.size()) {
    const model::FixedModel fixed(model);
    for (std::size_t k = 0; k < more.size(); ++k) angle[kFingers + k] = fixed.rest[more[k].joint];
  }

  std::array<std::int16_t, kFingers> alpha{};
  std::vector<std::int16_t> angle;

  std::uint8_t step() {
    std::uint8_t good = 0;
    for (std::size_t i = 0; i < reading_.size(); ++i) reading_[i] = alpha[wiring_.strip[i]] / 32.0;
    const auto samples = compensator_.step(reading_);
    for (std::size_t i = 0; i < kFingers; ++i) {
      angle[i] = 0;
      if (!wiring_.joint[i]) continue;
      const auto& sample = samples[*wiring_.joint[i]];
      angle[i] = static_cast<std::int16_t>(std::lround(16 * sample.angle_deg));
      if (sample.status == core::Status::ok) good = static_cast<std::uint8_t>(good | 1U << i);
    }
    for (std::size_t k = 0; k < more_.size(); ++k) {
      const auto& sample = samples[more_[k].joint];
      if (sample.status == core::Status::ok)
        angle[kFingers + k] = static_cast<std::int16_t>(std::lround(16 * sample.angle_deg));
    }
    return good;
  }

 private:
  model::Compensator<model::FixedArithmetic> compensator_;
  model::Wiring wiring_;
  std::vector<VrJoint> more_;
  std::vector<double> reading_;
};

// Not to be moved: the chain points into the tables and at the compensator.
class HostChain {
 public:
  explicit HostChain(const Glove& glove)
      : tables_(glove_tables(glove)),
        compensator_(glove.model, vr_joints(glove)),
        tracker_(model::tracker_settings<glove::Tracking>({})),
        tracked_(tracked_strips(glove)),
        chain_(settings(), compensator_,
               {tracker_, tracked_.data(),
                static_cast<std::uint8_t>(model::samples_per_tick(glove.model.sample_period_s))}) {}
  HostChain(const HostChain&) = delete;
  HostChain& operator=(const HostChain&) = delete;

  // One sample: counts of five strips to what a frame says.
  link::Frame step(const std::array<int, kFingers>& counts) {
    std::array<std::uint16_t, kFingers> n{};
    for (std::size_t i = 0; i < kFingers; ++i) n[i] = static_cast<std::uint16_t>(counts[i]);
    chain_.step(n.data(), frame_);
    return frame_;
  }

  // Of the joints beside the fingers, vr_joints(): Q4 degrees.
  const std::int16_t* joint_angles() const { return compensator_.angle.data() + kFingers; }

 private:
  const glove::ChannelSettings* settings() {
    for (std::size_t i = 0; i < kFingers; ++i)
      settings_[i] = {&tables_.calibration[i], tables_.monitor[i], tables_.guard[i], tables_.strips[i],
                      tables_.poses[i]};
    return settings_.data();
  }

  GloveTables tables_;
  std::array<glove::ChannelSettings, kFingers> settings_{};
  HostCompensator compensator_;
  glove::TrackerSettings tracker_;
  std::array<glove::TrackedStrip, kFingers> tracked_;
  glove::SignalChain<HostCompensator, glove::Follower<kFingers>> chain_;
  link::Frame frame_{};
};

}  // namespace flexor::deploy
