// Held poses as evidence: an open hand and a fist, which nobody holds as they were held before.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host/donning/recalibrate.hpp"

namespace flexor::donning {

struct PoseReading {
  std::vector<Sighting> sightings;
  std::vector<std::pair<std::size_t, std::string>> misfits;  // sensor, and what is wrong with it
  std::vector<std::string> notes;
};

// A pose errs by some degrees (5). Poses that most sensors read the other way round were swapped. Where a sensor's poses lie
// nearer to each other than half of what they did, one was not reached: that which lies farther from where it was.
// Throws io::InputError for a model without poses.
PoseReading read_poses(const model::Model& model, const std::vector<Hold>& holds,
                       const std::vector<model::Spread>& made);

// The stretches of a log in which all sensors rest for a second or more, as poses in the order of `fist`; readings evenly
// spaced, of each input as many. Empty where there are fewer.
std::vector<Hold> holds_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made, const std::vector<bool>& fist);

}  // namespace flexor::donning
