#include "host/listen/sample_clock.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::listen {
namespace {

constexpr double kLeastStep_s = 1e-4;  // of samples that came in one burst, without a clock of their own
constexpr double kAstray_s = 1;  // of the board's clock from the host's, between two samples: it started anew

}  // namespace

double SampleClock::time_s(const Sample& sample) {
  if (!first_host_s_) {
    first_host_s_ = last_host_s_ = sample.host_s;
    last_board_s_ = sample.board_s.value_or(0);
    return last_s_ = 0;
  }
  const double host_step_s = sample.host_s - last_host_s_;
  double t_s = sample.host_s - *first_host_s_;
  if (sample.board_s) {
    const double step_s = *sample.board_s - last_board_s_;
    const bool anew = step_s < 0 || std::abs(step_s - host_step_s) > kAstray_s;
    restarts_ += anew ? 1 : 0;
    t_s = last_s_ + (anew ? host_step_s : step_s);
    last_board_s_ = *sample.board_s;
  }
  last_host_s_ = sample.host_s;
  return last_s_ = std::max(t_s, last_s_ + kLeastStep_s);
}

}  // namespace flexor::listen
