// The glove's signal chain on a PC: the twin's, and the yardstick for what a board sends, to the bit.
#pragma once

#include "host/model/compensator.hpp"
#include "host/model/formats.hpp"
#include "host/model/glove_tables.hpp"
#include "host/model/tracking.hpp"
#include "runtime/glove/signal_chain.hpp"

namespace flexor::model {

class HostCompensator {
 public:
  // `more`: joints of the model whose angles follow the fingers'.
  explicit HostCompensator(const Model& model, std::vector<std::size_t> more = {})
      : angle(kFingers + more.size()),
        compensator_(model),
        wiring_(wiring_of(model)),
        more_(std::move(more)),
        reading_(model.inputs.size()) {
    const FixedModel fixed(model);
    for (std::size_t k = 0; k < more_.size(); ++k) angle[kFingers + k] = fixed.rest[more_[k]];
  }

  std::array<std::int16_t, kFingers> alpha{};
  std::vector<std::int16_t> angle;

  std::uint8_t step() {
    std::uint8_t good = 0;
    for (std::size_t i = 0; i < reading_.size(); ++i) reading_[i] = alpha[wiring_.sensor[i]] / 32.0;
    const auto samples = compensator_.step(reading_);
    for (std::size_t i = 0; i < kFingers; ++i) {
      angle[i] = 0;
      if (!wiring_.joint[i]) continue;
      const auto& sample = samples[*wiring_.joint[i]];
      angle[i] = static_cast<std::int16_t>(std::lround(16 * sample.angle_deg));
      if (sample.status == core::Status::ok) good = static_cast<std::uint8_t>(good | 1U << i);
    }
    for (std::size_t k = 0; k < more_.size(); ++k) {
      const auto& sample = samples[more_[k]];
      if (sample.status == core::Status::ok)
        angle[kFingers + k] = static_cast<std::int16_t>(std::lround(16 * sample.angle_deg));
    }
    return good;
  }

 private:
  Compensator<FixedArithmetic> compensator_;
  Wiring wiring_;
  std::vector<std::size_t> more_;
  std::vector<double> reading_;
};

// What chains of one glove start from.
struct ChainParts {
  GloveTables tables;
  HostCompensator compensator;
  std::array<glove::TrackedSensor, kFingers> tracked;  // none without `half`
  int samples_per_tick;                                // of the trackers
};

// Not to be moved: the chain points into the tables and at the compensator.
class HostChain {
 public:
  explicit HostChain(ChainParts parts)
      : parts_(std::move(parts)),
        tracker_(tracker_settings<glove::Tracking>({})),
        chain_(settings(), parts_.compensator,
               {tracker_, parts_.tracked.data(), static_cast<std::uint8_t>(parts_.samples_per_tick)}) {}
  HostChain(const HostChain&) = delete;
  HostChain& operator=(const HostChain&) = delete;

  // One sample: counts of five sensors to what a frame carries.
  const link::Frame& step(const std::array<int, kFingers>& counts) {
    std::array<std::uint16_t, kFingers> n{};
    for (std::size_t i = 0; i < kFingers; ++i) n[i] = static_cast<std::uint16_t>(counts[i]);
    chain_.step(n.data(), frame_);
    return frame_;
  }

  // Of the joints beside the fingers: Q4 degrees.
  const std::int16_t* joint_angles() const { return parts_.compensator.angle.data() + kFingers; }

 private:
  const glove::ChannelSettings* settings() {
    const GloveTables& t = parts_.tables;
    for (std::size_t i = 0; i < kFingers; ++i)
      settings_[i] = {&t.calibration[i], t.monitor[i], t.guard[i], t.sensors[i], t.poses[i]};
    return settings_.data();
  }

  ChainParts parts_;
  std::array<glove::ChannelSettings, kFingers> settings_{};
  glove::TrackerSettings tracker_;
  glove::SignalChain<HostCompensator, glove::Follower<kFingers>> chain_;
  link::Frame frame_{};
};

}  // namespace flexor::model
