// Random numbers that depend on names, not on the order in which things happen: a trial draws the same
// whatever runs beside it, on any number of threads, with any compensator.
#pragma once

#include <cstdint>

namespace flexor::twin {

// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): state in, well-mixed 64 bits out.
constexpr std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15U;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

// The seed of a named thing: mixes any number of keys, order matters.
template <class... Keys>
constexpr std::uint64_t seed_of(std::uint64_t seed, Keys... keys) {
  ((seed = mix(seed ^ mix(static_cast<std::uint64_t>(keys)))), ...);
  return seed;
}

class Random {
 public:
  explicit Random(std::uint64_t seed = 0) : state_(seed) {}

  std::uint64_t bits() {
    const std::uint64_t out = mix(state_);
    state_ += 0x9e3779b97f4a7c15U;
    return out;
  }

  // [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  // Mean 0, standard deviation 1, |z| < 4.9: the sum of eight uniforms. No mathematical function is called,
  // so that every machine draws the same.
  double normal() {
    std::int64_t sum = 0;
    for (int i = 0; i < 2; ++i) {
      const std::uint64_t b = bits();
      sum += static_cast<std::int64_t>((b & 0xffff) + (b >> 16 & 0xffff) + (b >> 32 & 0xffff) + (b >> 48));
    }
    constexpr double kMean = 8 * 65535 / 2.0;
    constexpr double kDeviation = 53509.80;  // sqrt(8 (65536^2 - 1) / 12)
    return (static_cast<double>(sum) - kMean) / kDeviation;
  }

 private:
  std::uint64_t state_;
};

}  // namespace flexor::twin
