// The time of samples from the two clocks that they come with: the board's where it has one, from 0 at the first sample,
// else the host's. It rises strictly; a counter that wraps goes on, a board that starts anew where the host's clock says.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/listen/decoder.hpp"
#include "host/recording/stream.hpp"

namespace flexor::listen {

class SampleClock {
 public:
  double time_s(const Sample& sample) {
    constexpr double kLeastStep_s = 1e-4;  // of samples that came in one burst, without a clock of their own
    constexpr double kAstray_s =
        1;  // of the board's clock from the host's, between two samples: it started anew
    constexpr double kLate_s =
        0.25;  // by which lines come late: a counter's wrap differs by less from the host's step
    const bool is_first = !std::exchange(has_begun_, true);
    if (is_first) first_host_s_ = last_host_s_ = sample.host_s;
    const double host_step_s = sample.host_s - std::exchange(last_host_s_, sample.host_s);
    double t_s = sample.host_s - first_host_s_;
    if (sample.board_s) {
      double step_s = *sample.board_s - std::exchange(last_board_s_, *sample.board_s);
      for (const double wrap_s : recording::kWraps_s) {
        if (step_s < 0 && std::abs(step_s + wrap_s - host_step_s) < kLate_s) step_s += wrap_s;
      }
      const bool is_anew = !is_first && (step_s < 0 || std::abs(step_s - host_step_s) > kAstray_s);
      restarts_ += is_anew ? 1 : 0;
      t_s = last_s_ + (is_anew ? host_step_s : step_s);
    }
    return last_s_ = is_first ? 0 : std::max(t_s, last_s_ + kLeastStep_s);
  }
  std::uint64_t restarts() const { return restarts_; }  // of the board's clock
  double last_s() const { return last_s_; }

 private:
  bool has_begun_ = false;
  std::uint64_t restarts_ = 0;
  double first_host_s_ = 0;
  double last_host_s_ = 0;
  double last_s_ = 0;
  double last_board_s_ = 0;
};

}  // namespace flexor::listen
