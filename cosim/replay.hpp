// The glove's image alone: fed with readings, compared with the host to the bit, and measured.
#pragma once

#include <string>
#include <vector>

#include "cosim/board.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {

using study::Counts;

// Replays `counts` as ADC readings at the model's rate; every byte that the board sends is compared with what
// the host would send. `messages`, if not null, gets all frames or lines.
deploy::GloveFigures replay(const deploy::Glove& glove, const Counts& counts,
                            std::vector<std::string>* messages = nullptr);

// Readings all over the range: ramps, steps, noise, dead sensors.
Counts exercise(std::size_t samples, std::uint32_t seed);

// The hand's image with frames coming in as fast as its radio carries them.
deploy::HandFigures measure_hand(const deploy::Hand& hand, double seconds);

}  // namespace flexor::cosim
