// Held poses as evidence: an open hand and a fist, which nobody holds as they were held before.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host/identify/recalibrate.hpp"

namespace flexor::identify {

struct PoseReading {
  std::vector<Sighting> sightings;
  std::vector<std::pair<std::size_t, std::string>> misfits;  // sensor, and what is wrong with it
};

// Poses that most sensors read the other way round were swapped. Of sensors without poses in the model nothing is said; where
// no more than half of the others moved from one pose to the other, nothing of any: these were not the poses. A fist that most
// sensors read far from where it was does not count; where it is the open hand that lies farther off, neither does. Notes and wants of all
// sensors together go into `said`.
PoseReading read_poses(const RecalibrationRequest& request, Recalibration& said);

// The stretches of a log in which all sensors rest for a second or more, as poses in the order of `fist`; readings evenly
// spaced, of each input as many. Empty where there are fewer.
std::vector<Hold> holds_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made, const std::vector<bool>& fist);

}  // namespace flexor::identify
