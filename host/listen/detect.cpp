#include "host/listen/detect.hpp"

#include <vector>

namespace flexor::listen {

std::optional<Guess> guess(std::span<const std::uint8_t> bytes) {
  constexpr std::uint64_t kFewestSamples = 3;
  constexpr std::uint64_t kFewestFrameBytes = 2 * 13;  // two states
  std::optional<Guess> best;
  for (const Format format : {Format::frames, Format::hand, Format::gloves, Format::lines}) {
    const auto decoder = make_decoder(format);
    std::vector<Sample> samples;
    decoder->push(bytes, 0, samples);
    const Tally& tally = decoder->tally();
    const bool frames = format == Format::frames || format == Format::hand;
    const bool waits = frames && tally.samples == 0 && tally.understood >= kFewestFrameBytes;
    if (tally.samples < (format == Format::hand ? 1 : kFewestSamples) && !waits) continue;
    const double share = static_cast<double>(tally.understood) / static_cast<double>(tally.bytes);
    if (share >= 0.5 && (!best || share > best->share)) best = Guess{format, share, tally.samples};
  }
  return best;
}

}  // namespace flexor::listen
