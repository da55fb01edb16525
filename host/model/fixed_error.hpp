// How far fixed point is from double, by searching for the inputs that take it furthest.
#pragma once

#include <cstdint>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

struct ErrorSearch {
  bool in_steps = true;  // inputs in the steps of Q5, as a board has them; otherwise any
  int attacks = 150;
  std::uint32_t seed = 1;
};

// Largest |fixed point - double| in degrees of one channel that was found, both given the same inputs: ramps,
// steps and noise over all valid inputs, and then attacks, each of which chooses the next input as the one
// that takes both furthest apart. Throws io::InputError when the channel does not fit fixed point.
double worst_fixed_error_deg(const Channel& channel, double period_s, const ErrorSearch& search = {});

// The same over given inputs, rounded to the steps of Q5.
double fixed_error_deg(const Channel& channel, double period_s, const std::vector<double>& inputs);

}  // namespace flexor::model
