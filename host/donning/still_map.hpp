// What a model says of readings that rest: its joints' angles once all memory has faded.
#pragma once

#include <vector>

#include "host/model/model.hpp"

namespace flexor::donning {

// Of each joint, degrees.
std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings);

// How the angles rise with one sensor's readings: over its spread, at the middle of each of eight equal parts of it, the
// others at their medians. Degrees by the sensor's unit; a row for each joint.
std::vector<std::vector<double>> slopes(const model::Model& model, std::size_t input);

// Of each joint: from the lowest to the highest angle over that sensor's spread, degrees.
std::vector<double> ranges_deg(const model::Model& model, std::size_t input);

}  // namespace flexor::donning
