// A model as a function of MATLAB and GNU Octave that needs no toolbox: the angles of Compensator<DoubleArithmetic>,
// whose coefficients it has.
//
//   [angle_deg, status, state] = NAME(readings, state)
//
// readings: a row for each sample of the model's period, a column for each input; angle_deg and status: a column for each
// joint. Status 0: the angle follows; 1 below, 2 above the valid range, 3 not a number: the last good angle is held, and
// so is the state of every block that the reading reaches. Without `state` it begins again.
#pragma once

#include <string>

#include "host/model/model.hpp"

namespace flexor::model {

// Throws io::InputError where MATLAB cannot call a function `name`, or this one would then call itself.
std::string matlab_text(const Model& model, const std::string& name);

}  // namespace flexor::model
