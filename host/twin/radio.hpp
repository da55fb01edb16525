// One glove's radio link: frames queue for the air, take 10 bits a byte at the baud rate, and arrive late,
// broken, or not at all. The receiver drops what the CRC rejects and what newer frames have overtaken.
#pragma once

#include <array>
#include <cstdint>

#include "host/twin/parameters.hpp"
#include "host/twin/random.hpp"

namespace flexor::twin {

using FrameAngles = std::array<std::int16_t, kFingers>;  // Q4 degrees

class Radio {
 public:
  static constexpr std::int64_t kNever = INT64_MAX;

  Radio() = default;
  Radio(const Parameters& parameters, std::uint64_t seed) : parameters_(&parameters), random_(seed) {}

  // At time now_ms, from the trial's start. A transmitter that is still busy with the frame before drops this
  // one.
  void send(std::int64_t now_ms, const FrameAngles& angles);

  std::int64_t next_arrival_ms() const { return next_ms_; }

  // The newest frame that has arrived by now_ms, or none.
  const FrameAngles* receive(std::int64_t now_ms);

  int sent() const { return sent_; }
  int lost() const { return lost_; }

 private:
  struct Frame {
    std::int64_t arrival_ms = kNever;
    int sequence = 0;
    FrameAngles angles{};
  };

  const Parameters* parameters_ = nullptr;
  Random random_;
  std::array<Frame, 64>
      in_air_{};  // 0.75 s, the greatest delay that a link bears, at any rate that fits the baud rate
  FrameAngles latest_{};
  std::int64_t next_ms_ = kNever;
  double busy_until_s_ = -1e9;
  int sent_ = 0;
  int lost_ = 0;
  int newest_ = -1;
};

}  // namespace flexor::twin
