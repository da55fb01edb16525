// The hand's end of the link: bytes in, frames that can be trusted out, everything else counted.
//
// A sealed frame is accepted when its tag fits a counter above every one accepted before: the sequence on the
// wire is the counter's low half, its high half is the last one's or, after a wrap or a restart of the glove,
// one of the next kEpochsAhead. Replayed, reordered and forged frames fail.
#pragma once

#include "runtime/link/frame.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kEpochsAhead = 4;  // restarts of the glove that the hand may miss; a tag is tried for each

enum class Received : uint8_t {
  nothing,      // no frame has ended yet
  pending,      // a frame has ended well so far: call verify() until it says something else
  frame,        // `frame()` is new and trusted
  malformed,    // not COBS, or of no known length
  corrupt,      // the CRC does not fit
  unknown,      // another version
  not_trusted,  // the tag fits no counter that may come: forged, replayed, reordered, or another pair's
};

struct LinkStatistics {
  uint32_t received;
  uint32_t lost;  // gaps in the sequence
  uint32_t malformed;
  uint32_t corrupt;
  uint32_t not_trusted;
};

class Receiver {
 public:
  // `key` null: frames are not authenticated, and only the sequence guards against replay.
  explicit Receiver(const Key* key) : key_(key) {}

  // Nothing up to `last_counter`, which an earlier run kept, is believed again.
  void resume(uint32_t last_counter) { last_ = last_counter; }

  // One byte, never a tag computed: a microcontroller with a loop to serve takes its time over verify(). Not
  // to be called while a frame is pending.
  Received push(uint8_t byte) {
    if (byte != kDelimiter) {
      if (size_ < sizeof(buffer_)) {
        buffer_[size_++] = byte;
      } else {
        too_long_ = true;
      }
      return Received::nothing;
    }
    const uint8_t size = size_;
    const bool too_long = too_long_;
    size_ = 0;
    too_long_ = false;
    if (size == 0) return Received::nothing;
    return counted(too_long ? Received::malformed : examine(size));
  }

  // Tries one epoch: at most one tag.
  Received verify() {
    const uint16_t sequence = static_cast<uint16_t>(buffer_[0] | (buffer_[1] << 8));
    while (tried_ <= kEpochsAhead) {
      const uint16_t epoch = static_cast<uint16_t>((last_ >> 16) + tried_++);
      const uint32_t counter = (static_cast<uint32_t>(epoch) << 16) | sequence;
      if (counter <= last_) continue;
      if (key_ == nullptr || fits(counter)) return accept(counter);
      if (tried_ <= kEpochsAhead) return Received::pending;
    }
    return counted(Received::not_trusted);
  }

  // push() and verify() in one.
  Received receive(uint8_t byte) {
    Received result = push(byte);
    while (result == Received::pending) result = verify();
    return result;
  }

  const Frame& frame() const { return frame_; }
  const LinkStatistics& statistics() const { return statistics_; }

 private:
  Received counted(Received result) {
    if (result == Received::malformed) ++statistics_.malformed;
    if (result == Received::corrupt) ++statistics_.corrupt;
    if (result == Received::not_trusted) ++statistics_.not_trusted;
    return result;
  }

  Received examine(uint8_t size) {
    const uint8_t payload = cobs_decode(buffer_, size);
    if (payload != kPlainBytes && payload != kSealedBytes) return Received::malformed;
    const uint8_t checked = static_cast<uint8_t>(payload - 2);
    const uint16_t crc = static_cast<uint16_t>((buffer_[checked] << 8) | buffer_[checked + 1]);
    if (crc16(buffer_, checked) != crc) return Received::corrupt;
    if (detail::version_of(buffer_ + 4) != kVersion) return Received::unknown;
    if ((key_ != nullptr) != (payload == kSealedBytes)) return Received::not_trusted;
    tried_ = 0;
    return Received::pending;
  }

  Received accept(uint32_t counter) {
    const uint32_t gap = counter - last_ - 1;
    if (statistics_.received > 0 && gap < 0x8000) statistics_.lost += gap;
    last_ = counter;
    ++statistics_.received;
    frame_.counter = counter;
    frame_.time_ms = static_cast<uint16_t>(buffer_[2] | (buffer_[3] << 8));
    detail::unpack(buffer_ + 4, frame_);
    return Received::frame;
  }

  // Compares all bytes whatever the first ones say.
  bool fits(uint32_t counter) const {
    const uint64_t tag = detail::tag_of(*key_, counter, buffer_);
    uint8_t expected[sizeof(tag)];
    __builtin_memcpy(expected, &tag, sizeof(tag));
    uint8_t difference = 0;
    for (uint8_t i = 0; i < kTagBytes; ++i) {
      difference = static_cast<uint8_t>(difference | (buffer_[kBodyBytes + i] ^ expected[i]));
    }
    return difference == 0;
  }

  LinkStatistics statistics_ = {};  // first, where a debugger finds it
  const Key* key_;
  uint32_t last_ = 0;
  bool too_long_ = false;
  uint8_t tried_ = 0;  // epochs
  uint8_t size_ = 0;
  uint8_t buffer_[kWireSealed - 1];
  Frame frame_ = {};
};

}  // namespace link
}  // namespace flexor
