// The time of samples from the two clocks that they come with: the board's where it has one, from 0 at the first sample,
// else the host's. It rises strictly; a board that starts anew goes on where the host's clock says.
#pragma once

#include "host/listen/decoder.hpp"

namespace flexor::listen {

class SampleClock {
 public:
  double time_s(const Sample& sample);
  std::uint64_t restarts() const { return restarts_; }  // of the board's clock
  double last_s() const { return last_s_; }

 private:
  std::uint64_t restarts_ = 0;
  std::optional<double> first_host_s_;
  double last_host_s_ = 0;
  double last_s_ = 0;
  double last_board_s_ = 0;
};

}  // namespace flexor::listen
