// How far fixed point is from double, by searching for the inputs that take it furthest.
#pragma once

#include <cstdint>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

struct ErrorSearch {
  bool in_steps = true;  // inputs in the steps of Q5, as a board has them; otherwise any
  int attacks = 150;
  int noise = 20000;  // readings
  std::uint32_t seed = 1;
};

// By how much a joint's fixed point may be off double: kFixedError_deg, or a tenth of the error that the joint states of itself,
// root mean square over its angles, which makes that error at most half a per cent larger.
double allowed_fixed_error_deg(const Joint& joint);

// Largest |fixed point - double| in degrees of each joint that was found, both given the same readings:
// ramps, steps and noise over all valid readings, and then attacks, each of which chooses the next readings as
// those that take both furthest apart. Throws io::InputError when the model does not fit fixed point.
std::vector<double> worst_fixed_error_deg(const Model& model, const ErrorSearch& search = {});

// The same over given readings, one of each input in a row, rounded to the steps of Q5.
std::vector<double> fixed_error_deg(const Model& model, const std::vector<std::vector<double>>& readings);

}  // namespace flexor::model
