// What a model says of readings that rest: its joints' angles once all memory has faded.
#pragma once

#include <vector>

#include "host/model/model.hpp"

namespace flexor::identify {

// Of each joint, degrees.
std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings);

// How the joints' angles go along one sensor's spread, the other sensors at their medians.
struct Reach {
  std::vector<std::vector<double>> slopes;  // of each joint in each of eight equal parts, degrees by the unit
  std::vector<double> range_deg;            // of each joint, from its lowest angle to its highest
  double most_deg = 0;                      // the largest of these
  int bends = 0;  // as the joint bends that it tells most of, 1: readings rise, -1: they fall, 0: not known
};

// All inputs of the model say what they read.
Reach reach_of(const model::Model& model, std::size_t input);

}  // namespace flexor::identify
