// The glove's image alone: fed with readings, compared with the host to the bit, and measured.
#pragma once

#include <string>
#include <vector>

#include "cosim/board.hpp"
#include "host/experiment/boards.hpp"

namespace flexor::cosim {

using experiment::Counts;

// Replays `counts` as ADC readings at the model's rate, for a glove with output radio.
experiment::GloveFigures replay(const Firmware& firmware, const deploy::Glove& glove, const Counts& counts);

// Readings all over the range: ramps, steps, noise, dead sensors.
Counts exercise(std::size_t samples, std::uint32_t seed);

// What the text output says on the same readings, line by line.
std::vector<std::string> replay_opengloves(const Firmware& firmware, const Counts& counts);

// The hand's image with frames of `glove`'s key coming in as fast as its radio carries them.
experiment::HandFigures measure_hand(const Firmware& firmware, const deploy::Glove& glove, double seconds);

}  // namespace flexor::cosim
