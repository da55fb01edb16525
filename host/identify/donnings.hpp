// What varies from donning to donning of a glove.
#pragma once

#include <optional>
#include <vector>

#include "host/identify/additive.hpp"

namespace flexor::identify {

// How the recordings of one joint differ from what all of them share, a donning each: angle = offset + gain estimate
// about the middle of the range, fitted to each recording. Standard deviations over the recordings.
struct Donnings {
  int count = 0;
  double offset_deg = 0;
  double gain = 0;
};

// `model` has one joint, which ends with a saturation, and its inputs in the order of the sessions' columns. None unless
// the finger moved in two recordings or more.
std::optional<Donnings> donnings_of(const std::vector<Session>& sessions, const model::Model& model);

}  // namespace flexor::identify
