// How late frames come, from the sender's clock and the receiver's, which run apart by an unknown offset.
//
//   d_k = now_k - sent_k (mod 2^16 ms),   late_k = d_k - min_{j <= k} d_j
// The quickest frame is taken for punctual, so that `late` is what queues, retries and jitter add to the
// way's fixed time. Every kForget frames the minimum gives way by a millisecond: two crystals drift apart by
// some 50 ms an hour.
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

class Latency {
 public:
  // Milliseconds that this frame was later than the quickest.
  uint16_t add(uint16_t now_ms, uint16_t sent_ms) {
    const uint16_t way = static_cast<uint16_t>(now_ms - sent_ms);
    if (!started_ || static_cast<int16_t>(way - quickest_) < 0) {
      quickest_ = way;
      started_ = true;
    }
    const uint16_t late_ms = static_cast<uint16_t>(way - quickest_);
    if (++frames_ >= kForget) {
      frames_ = 0;
      ++quickest_;
    }
    return late_ms;
  }

  // The sender has started again: its clock, too.
  void restart() { started_ = false; }

 private:
  static constexpr uint16_t kForget = 1024;

  uint16_t quickest_ = 0;
  uint16_t frames_ = 0;
  bool started_ = false;
};

}  // namespace link
}  // namespace flexor
