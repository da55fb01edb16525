// A sensor that reads otherwise than it did where the model was made, because the glove was put on again:
//
//   reading as it was made = gain reading + shift        in the input's unit
//
// identify also brings volts or ohms to the size of counts by such a gain.
//
// In a document this is a gain block behind the input, called "calibrated INPUT", before everything else that takes it:
// whatever runs the document runs it corrected. A board needs no block: it has the line in its table of counts
// (host/deploy), for which folded() takes it out again.
#pragma once

#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

struct Correction {
  double gain = 1;  // above 0
  double shift = 0;

  double operator()(double reading) const { return gain * reading + shift; }
  double inverse(double made) const { return (made - shift) / gain; }
  // This one after `first`.
  Correction after(const Correction& first) const { return {gain * first.gain, gain * first.shift + shift}; }
  bool operator==(const Correction&) const = default;
};

// Of model.inputs[input]; none: it reads as it was made.
Correction correction_of(const Model& model, std::size_t input);

// The model whose input reads `correction(reading)` where it read that before; before what corrected it already. Poses and
// readings are given as the sensor reads now, and so is the valid range unless it is that of an ADC's counts, whose rails
// stay where they are. Throws io::InputError where the model would break a rule of model.hpp.
Model corrected(Model model, std::size_t input, const Correction& correction);

struct Folded {
  Model model;                         // takes readings as they were made
  std::vector<Correction> correction;  // of each input
};
Folded folded(Model model);

}  // namespace flexor::model
