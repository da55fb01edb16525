// How fixed point holds each signal of a model: a fraction for each, and integer coefficients for each block.
#pragma once

#include <vector>

#include "host/model/model.hpp"
#include "runtime/core/fixed_point.hpp"

namespace flexor::model {

// Integer coefficients of a block of kind K; two kinds may run the same runtime block.
template <class K>
struct FixedCoefficients {
  typename K::Fixed c;
};

using FixedKind = EachOf<FixedCoefficients, Kind>::type;

// Signals are int16, round(value 2^fraction). Each fraction is the largest that holds all values that matter:
// from the joints back, a block states what it needs of its input (Need); what lies beyond saturates and changes
// no angle. Inputs come in Q5, joints leave in Q4.
struct FixedModel {
  explicit FixedModel(const Model& model);  // throws io::InputError where a number does not fit

  Graph graph;
  std::vector<FixedSignal> signals;  // as in Graph
  std::vector<FixedKind> blocks;
  std::vector<std::int16_t> valid_min;  // of inputs, Q5
  std::vector<std::int16_t> valid_max;
  std::vector<std::int16_t> rest;  // of joints, Q4, within their limits
};

// Whether fixed point holds every reading of the input: those of an ADC of 10 bits, not of 12, nor ohms.
bool holds_readings(const Input& input);

// Throws io::InputError unless the model fits fixed point.
inline void check_fixed(const Model& model) { (void)FixedModel(model); }

}  // namespace flexor::model
