#include "host/listen/detect.hpp"

#include <vector>

namespace flexor::listen {
namespace {

// None: too little of it for this format.
std::optional<Guess> judge(std::span<const std::uint8_t> bytes, Format format, bool readings) {
  constexpr std::uint64_t kFewestSamples = 3;
  constexpr std::uint64_t kFewestFrameBytes = 2 * 13;  // two states
  const auto decoder = make_decoder(format, readings);
  std::vector<Sample> samples;
  decoder->push(bytes, 0, samples);
  const Tally& tally = decoder->tally();
  const bool frames = format == Format::frames || format == Format::hand;
  const bool waits = frames && tally.samples == 0 && tally.understood >= kFewestFrameBytes;
  if (tally.samples < (format == Format::hand ? 1 : kFewestSamples) && !waits) return {};
  const double share = static_cast<double>(tally.understood) / static_cast<double>(tally.bytes);
  if (share < 0.5) return {};
  return Guess{format, readings, share, tally.samples};
}

}  // namespace

std::optional<Guess> guess(std::span<const std::uint8_t> bytes, bool readings) {
  if (readings) {
    const std::optional<Guess> frames = judge(bytes, Format::frames, true);
    if (frames && frames->samples > 0) return frames;  // nothing else speaks so
  }
  std::optional<Guess> best;
  for (const Format format : {Format::frames, Format::hand, Format::gloves, Format::lines}) {
    const std::optional<Guess> now = judge(bytes, format, false);
    if (now && (!best || now->share > best->share)) best = now;
  }
  return best;
}

}  // namespace flexor::listen
