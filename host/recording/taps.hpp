// A synchronisation that a finger taps: three quick bends in a row between two rests, as the recommended motion begins.
#pragma once

#include <array>
#include <optional>

#include "host/recording/recording.hpp"

namespace flexor::recording {

// The instants at which the three bends turn back, on the series' clock. The bends go one way, by a quarter of the range or
// more, 0.3 to 1.5 s from one to the next, as long as one another within a factor of 1.6; a second before and behind them the
// series rests within a tenth of the range. None where there is no such triple, or more than one.
std::optional<std::array<double, 3>> taps(const Series& series);

}  // namespace flexor::recording
