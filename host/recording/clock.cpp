#include "host/recording/clock.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::recording {
namespace {

constexpr double kVelocityError_s = 0.1;  // of an offset from velocities alone
constexpr double kLeastConfidence = 1e-3;

double weight(const ClockOpinion& o) {
  return std::max(o.confidence, kLeastConfidence) / (o.error_s * o.error_s);
}

}  // namespace

ClockOpinion opinion_of(const Alignment& a, std::size_t of) {
  return {of, a.clock_offset_s, a.confidence, a.clock_offset_se_s.value_or(kVelocityError_s),
          a.sensor_lag_s.value_or(0)};
}

void keep_agreeing(std::vector<ClockOpinion>& opinions) {
  const ClockOpinion best = *std::ranges::max_element(opinions, {}, &ClockOpinion::confidence);
  std::erase_if(opinions,
                [&](const ClockOpinion& o) { return std::abs(o.offset_s - best.offset_s) > kSameClock_s; });
}

AgreedClock agreed_clock(const std::vector<ClockOpinion>& opinions) {
  AgreedClock out;
  double all = 0;
  for (const ClockOpinion& o : opinions) {
    all += weight(o);
    out.offset_s += weight(o) * o.offset_s;
  }
  out.offset_s /= all;
  double squares = 0;
  double doubt = 1;
  for (const ClockOpinion& o : opinions) {
    const double error_s = weight(o) * std::max(o.error_s, std::abs(o.offset_s - out.offset_s));
    squares += error_s * error_s;
    doubt *= 1 - o.confidence;
  }
  out.standard_error_s = std::sqrt(squares) / all;
  out.confidence = 1 - doubt;
  return out;
}

}  // namespace flexor::recording
