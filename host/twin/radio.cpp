#include "host/twin/radio.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::twin {

void Radio::send(std::int64_t now_ms, const FrameAngles& angles) {
  const Parameters& p = *parameters_;
  const double now_s = static_cast<double>(now_ms) / 1000;
  const int sequence = sent_++;
  // Always the same number of draws: one lost frame must not change what the next one meets.
  const double delay_s = p.jitter_s * random_.uniform();
  const bool lost = random_.uniform() < p.loss;
  const bool corrupt = random_.uniform() < p.corruption;
  const bool outage = now_s >= p.outage_start_s && now_s < p.outage_start_s + p.outage_s;
  const double airtime_s = p.frame_bytes * 10 / p.baud;
  const double start_s = std::max(now_s, busy_until_s_);
  if (start_s - now_s > airtime_s) {
    ++lost_;
    return;
  }
  busy_until_s_ = start_s + airtime_s;
  const auto free = std::ranges::find(in_air_, kNever, &Frame::arrival_ms);
  if (lost || corrupt || outage || free == in_air_.end()) {
    ++lost_;
    return;
  }
  free->arrival_ms =
      static_cast<std::int64_t>(std::ceil((busy_until_s_ + p.module_latency_s + delay_s) * 1000));
  free->sequence = sequence;
  free->angles = angles;
  next_ms_ = std::min(next_ms_, free->arrival_ms);
}

const FrameAngles* Radio::receive(std::int64_t now_ms) {
  if (now_ms < next_ms_) return nullptr;
  const int before = newest_;
  for (Frame& frame : in_air_) {
    if (frame.arrival_ms > now_ms) continue;
    frame.arrival_ms = kNever;
    if (frame.sequence > newest_) {
      newest_ = frame.sequence;
      latest_ = frame.angles;
    } else {
      ++lost_;
    }
  }
  next_ms_ = std::ranges::min_element(in_air_, {}, &Frame::arrival_ms)->arrival_ms;
  return newest_ > before ? &latest_ : nullptr;
}

}  // namespace flexor::twin
