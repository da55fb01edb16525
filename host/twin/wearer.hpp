// Somebody who wears the glove for as long as one likes, and does what he or she is asked to do next.
//
// From where the hand is it goes to the motion's beginning, no finger faster than kJoinSpeed_deg_s, rests there for
// kBefore_ms and plays the motion from its t = 0; then it rests for kAfter_ms, and again from the beginning. From t = 0
// to the rest's end the angles are those of a trial with this motion and variation, to the bit.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "host/twin/motion.hpp"

namespace flexor::twin {

class Wearer {
 public:
  static constexpr double kJoinSpeed_deg_s = 83;
  static constexpr std::int64_t kBefore_ms = 500;
  static constexpr std::int64_t kAfter_ms = 2000;

  // At rest, where `pose` begins.
  Wearer(const Variation& variation, const Motion& pose);

  // Times are multiples of kBlock_ms, and do not go back.
  void play(Motion motion, std::int64_t now_ms) { go_to(std::move(motion), now_ms); }
  void rest(std::int64_t now_ms) { go_to(std::nullopt, now_ms); }
  // Before a motion's t = 0, this once so much longer.
  void postpone(std::int64_t ms) { before_ms_ += ms; }

  double angle(int finger, std::int64_t t_ms);

  // When the motion that is played is at its t = 0, or was; none: at rest.
  std::optional<std::int64_t> start_ms() const;

 private:
  void go_to(std::optional<Motion> motion, std::int64_t now_ms);
  void begin(std::int64_t now_ms);
  double at(int finger, std::int64_t t_ms) const;
  double first(int finger) const;

  Variation variation_;
  PerFinger rest_deg_{};
  std::optional<Motion> motion_;
  PerFinger from_deg_{};
  std::int64_t begin_ms_ = 0;
  std::int64_t join_ms_ = 0;
  std::int64_t before_ms_ = kBefore_ms;
};

}  // namespace flexor::twin
