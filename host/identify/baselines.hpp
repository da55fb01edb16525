// What a fit is measured against: simple compensators with the same advantages, fitted to the same samples of
// one joint's own sensor.
#pragma once

#include <string>
#include <vector>

#include "host/recording/pair.hpp"

namespace flexor::identify {

struct Baseline {
  std::string name;
  std::vector<double> held_out_deg;  // estimates of all pairs' held-out samples
  std::string refusal;               // set: could not be fitted
};

// line            gain and offset, within the range of the angle
// line_lead       the same of the reading and of its motion, u - H_tau u, the best of some tau: a lag or a lead
// published_form  dead zone, gain, first-order lag, saturation (Sensors 2019, 19(18), 3896), all fitted
std::vector<Baseline> baselines(const std::vector<const recording::Aligned*>& pairs);

}  // namespace flexor::identify
