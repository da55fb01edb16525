// The glove's image alone: fed with readings, compared with the host to the bit, and measured.
#pragma once

#include <array>
#include <vector>

#include "cosim/board.hpp"
#include "host/deploy/config.hpp"

namespace flexor::cosim {

using Counts = std::vector<std::array<int, deploy::kFingers>>;  // sample by sample

struct CycleStatistic {
  std::uint64_t count = 0;
  std::uint64_t sum = 0;
  std::uint64_t worst = 0;
  void add(std::uint64_t cycles);
  double mean() const { return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0; }
};

struct ReplayResult {
  std::size_t samples = 0;
  std::size_t frames = 0;
  std::size_t angles = 0;      // compared
  std::size_t mismatches = 0;  // angles and states that differ from the host's by anything at all
  CycleStatistic step;         // compensator, five channels; the first, which starts it, left out; markers subtracted
  CycleStatistic sample;       // all of a sample's work, until the frame is sealed
  int stack_bytes = 0;
  double awake_share = 0;
};

// Replays `counts` as ADC readings at the model's rate, for a glove with output radio.
ReplayResult replay(const Firmware& firmware, const deploy::Glove& glove, const Counts& counts);

// Readings all over the range: ramps, steps, noise, dead sensors.
Counts exercise(std::size_t samples, std::uint32_t seed);

// What the text output says on the same readings, line by line.
std::vector<std::string> replay_opengloves(const Firmware& firmware, const Counts& counts);

struct HandFigures {
  CycleStatistic tick;  // five position loops, motors included
  int stack_bytes = 0;
  double awake_share = 0;
};

// The hand's image with frames of `glove`'s key coming in as fast as its radio carries them.
HandFigures measure_hand(const Firmware& firmware, const deploy::Glove& glove, double seconds);

}  // namespace flexor::cosim
