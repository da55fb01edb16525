// Bytes in, frames out: PacketReader finds what is whole, Receiver believes angles, everything else is counted.
//
// With a key, a frame is believed when its tag fits the session's key and a counter above every one before:
// the low 16 bits of the counter travel, the others are those of the next one that may come. Replayed,
// reordered and forged frames fail. Without a key whatever is whole is believed: nothing guards it, and so
// nothing that a wrong sender sends can shut the right one out.
#pragma once

#include "runtime/link/messages.hpp"
#include "runtime/link/session.hpp"

namespace flexor {
namespace link {

enum class Received : uint8_t {
  nothing,      // no frame has ended yet
  pending,      // a frame has ended well so far: call verify() until it returns something else
  frame,        // `frame()` is new and trusted
  other,        // whole, and not the angles of a hand
  malformed,    // not COBS, or of no known length
  corrupt,      // the CRC does not fit
  unknown,      // another version
  not_trusted,  // the tag fits no counter that may come: forged, replayed, reordered, or another pair's
};

class PacketReader {
 public:
  // pending: a whole packet lies here until the next call.
  Received push(uint8_t byte) {
    if (byte != kDelimiter) {
      if (size_ < kMaxWire - 1) packet_.wire()[size_] = byte;
      if (size_ < kMaxWire) ++size_;  // kMaxWire: too long
      return Received::nothing;
    }
    const uint8_t size = size_;
    size_ = 0;
    if (size == 0) return Received::nothing;
    return size == kMaxWire ? Received::malformed : examine(size);
  }

  // A packet has begun, and may still end well.
  bool amid() const { return size_ > 0 && size_ < kMaxWire; }

  Type type() const { return static_cast<Type>(packet_.first() & 15); }
  bool guarded() const { return (packet_.first() & detail::kGuarded) != 0; }
  bool listens() const { return (packet_.first() & detail::kListens) != 0; }
  uint16_t sequence() const { return packet_.sequence(); }
  const uint8_t* body() const { return packet_.body(); }
  uint8_t body_bytes() const { return body_bytes_; }
  // One SipHash.
  bool fits(const Key& key, uint32_t counter) { return packet_.fits(key, counter, body_bytes_); }

 private:
  Received examine(uint8_t size) {
    const uint8_t payload = cobs_decode(packet_.wire(), size);
    if (payload < kHeadBytes + kCrcBytes) return Received::malformed;
    const uint8_t checked = static_cast<uint8_t>(payload - kCrcBytes);
    const uint8_t* crc = packet_.wire() + checked;
    if (detail::crc_of(packet_.wire(), checked) != static_cast<uint16_t>((crc[0] << 8) | crc[1])) {
      return Received::corrupt;
    }
    if (packet_.first() >> 6 != kVersion) return Received::unknown;
    const uint8_t around = static_cast<uint8_t>(kHeadBytes + (guarded() ? kTagBytes : 0));
    if (checked < around || checked - around > kMaxBody) return Received::malformed;
    body_bytes_ = static_cast<uint8_t>(checked - around);
    return Received::pending;
  }

  uint8_t size_ = 0;
  uint8_t body_bytes_ = 0;
  Packet packet_;
};

struct LinkStatistics {
  uint32_t received;
  uint32_t lost;  // gaps in the sequence
  uint32_t malformed;
  uint32_t corrupt;
  uint32_t not_trusted;
};

// What guards against frames that came before. The counter is believed once, upwards only.
class Window {
 public:
  void restart() { next_ = 0; }
  // The counter that a sequence stands for; kCounters or more: none that may come.
  uint32_t counter_of(uint16_t sequence) const {
    const uint32_t counter = (next_ & 0xffff0000UL) | sequence;
    return counter < next_ ? counter + 0x10000UL : counter;
  }
  void accept(uint32_t counter) { next_ = counter + 1; }
  uint32_t next() const { return next_; }

 private:
  uint32_t next_ = 0;
};

class Receiver {
 public:
  // `key` of the pair; null: frames are not guarded.
  explicit Receiver(const Key* key) : key_(key) {}

  // Only frames that answer this challenge are believed from now on.
  void challenge(const Nonce& nonce) {
    session_.start(nonce);
    window_.restart();
    answered_ = false;
  }

  // One byte, never a tag computed: a microcontroller with a loop to serve takes its time over verify(). Not
  // to be called while a frame is pending.
  Received push(uint8_t byte) {
    Received result = reader_.push(byte);
    if (result == Received::pending && reader_.type() != Type::angles) result = Received::other;
    if (result == Received::pending && joints_in(reader_.body_bytes()) < kFingers) result = Received::other;
    if (result == Received::pending && !may_be_trusted()) result = Received::not_trusted;
    return counted(result);
  }

  // Computes one SipHash at most.
  Received verify() {
    if (key_ == nullptr) return accept_unguarded();
    if (!session_.ready()) {
      session_.derive(*key_);
      return Received::pending;
    }
    const uint32_t counter = window_.counter_of(reader_.sequence());
    if (counter >= kCounters || !reader_.fits(session_.key(), counter)) return counted(Received::not_trusted);
    return accept(counter, counter - window_.next());
  }

  // push() and verify() in one.
  Received receive(uint8_t byte) {
    Received result = push(byte);
    while (result == Received::pending) result = verify();
    return result;
  }

  const Frame& frame() const { return frame_; }
  const PacketReader& packet() const { return reader_; }
  const Session& session() const { return session_; }
  const Key* pair() const { return key_; }
  bool answered() const { return answered_; }  // a frame has been believed since the challenge
  const LinkStatistics& statistics() const { return statistics_; }

 private:
  Received counted(Received result) {
    if (result == Received::malformed) ++statistics_.malformed;
    if (result == Received::corrupt) ++statistics_.corrupt;
    if (result == Received::not_trusted) ++statistics_.not_trusted;
    return result;
  }

  bool may_be_trusted() const {
    return key_ == nullptr ? !reader_.guarded() : reader_.guarded() && session_.started();
  }

  Received accept_unguarded() {
    const uint16_t gap = static_cast<uint16_t>(reader_.sequence() - window_.next());
    return accept(reader_.sequence(), gap < 0x8000 ? gap : 0);
  }

  Received accept(uint32_t counter, uint32_t gap) {
    if (answered_) statistics_.lost += gap;
    answered_ = true;
    window_.accept(counter);
    ++statistics_.received;
    frame_.counter = counter;
    get_angles(reader_.body(), kFingers, frame_.time_ms, frame_.angle, frame_.status);
    return Received::frame;
  }

  LinkStatistics statistics_ = {};  // first, where a debugger finds it
  const Key* key_;
  bool answered_ = false;
  Session session_;
  Window window_;
  PacketReader reader_;
  Frame frame_ = {};
};

}  // namespace link
}  // namespace flexor
