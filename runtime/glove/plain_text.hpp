// Lines for people and for `flexor record`: a header, then for each sample its time and five columns.
//
//   time_ms,thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg        time_ms,thumb_count,index_count, ...
//   120,31.3,,56.1,90.0,12.4                                         120,512,498,505,530,520
// An angle whose sensor is broken is an empty cell. The same code on the glove and on a PC.
#pragma once

#include "runtime/core/memory.hpp"
#include "runtime/link/messages.hpp"

namespace flexor {
namespace glove {

constexpr uint8_t kMaxPlainText = 96;

class PlainText {
 public:
  PlainText(bool counts, uint16_t period_ms) : counts_(counts), period_ms_(period_ms) {}

  // counts: kFingers readings. `text` has kMaxPlainText; returns the bytes written.
  uint8_t step(const link::Frame& frame, const uint16_t* counts, char* text) {
    char* at = text;
    if (!begun_) {
      static const char kAngles[] FLEXOR_IN_FLASH =
          "time_ms,thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg\n";
      static const char kCounts[] FLEXOR_IN_FLASH =
          "time_ms,thumb_count,index_count,middle_count,ring_count,pinky_count\n";
      begun_ = true;
      return copy(counts_ ? kCounts : kAngles, text);
    }
    at = number(at, time_ms_, 0);
    for (uint8_t i = 0; i < link::kFingers; ++i) {
      *at++ = ',';
      if (counts_) at = number(at, counts[i], 0);
      if (!counts_ && frame.status[i] == link::SensorStatus::ok) at = angle(at, frame.angle[i]);
    }
    *at++ = '\n';
    time_ms_ += period_ms_;
    return static_cast<uint8_t>(at - text);
  }

 private:
  static uint8_t copy(const char* from, char* text) {
    uint8_t n = 0;
    for (; (text[n] = static_cast<char>(core::Flash::byte(reinterpret_cast<const uint8_t*>(from) + n))) != 0;
         ++n) {
    }
    return n;
  }

  // Q4 degrees to tenths.
  static char* angle(char* at, int16_t q4) {
    if (q4 < 0) *at++ = '-';
    const uint16_t size = static_cast<uint16_t>(q4 < 0 ? -q4 : q4);
    return number(at, (static_cast<uint32_t>(10) * size + 8) >> 4, 1);
  }

  // `value` with its last `decimals` digits behind a point.
  static char* number(char* at, uint32_t value, uint8_t decimals) {
    char digits[10];
    uint8_t n = 0;
    do {
      digits[n++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value > 0 || n <= decimals);
    while (n > 0) {
      if (n == decimals) *at++ = '.';
      *at++ = digits[--n];
    }
    return at;
  }

  bool counts_;
  bool begun_ = false;
  uint16_t period_ms_;
  uint32_t time_ms_ = 0;
};

}  // namespace glove
}  // namespace flexor
