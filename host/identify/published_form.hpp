// What a fit is measured against beside lines (candidates() in additive.hpp): the published form, with the same
// advantages, fitted to the same samples of one joint's own sensor.
#pragma once

#include <string>
#include <vector>

#include "host/recording/pair.hpp"

namespace flexor::identify {

struct PublishedForm {
  std::vector<double> held_out_deg;  // estimates of all pairs' held-out samples
  std::string refusal;               // set: could not be fitted
};

// Dead zone, gain, first-order lag, saturation (Sensors 2019, 19(18), 3896), all fitted.
PublishedForm published_form(const std::vector<const recording::Aligned*>& pairs);

}  // namespace flexor::identify
