// Which format bytes are of.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "host/listen/decoder.hpp"

namespace flexor::listen {

struct Guess {
  Format format;
  bool readings;  // of frames: the samples are readings
  double share;   // of the bytes that are in whole frames or lines
  std::uint64_t
      samples;  // 0: frames, but no samples: a glove that waits for its hand, or a hand for its glove
};

// The format that most of the bytes are in; none where that is less than half of them, or fewer than three samples (one
// of a hand, which speaks twice a second) or two frames of other kinds. `readings`: of a glove that gives them they are the
// samples, instead of angles.
std::optional<Guess> guess(std::span<const std::uint8_t> bytes, bool readings = false);

}  // namespace flexor::listen
