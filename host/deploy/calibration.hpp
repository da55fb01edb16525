// A glove's own calibration as a document.
//
// {"schema": "flexor-calibration", "schema_version": 1, "unit": "deg",
//  "fingers": {"thumb": {"counts": [430, 700], "value": [20, 140]}, ...}}
// value is in the model's input unit, which "unit" states. It may be left out where the model reads counts or
// the divider's alpha, and would do without a calibration. Two points are a line, more a curve; both go on
// straight beyond their ends. Counts lie 0.001 apart at least, between 0 and 1023; values within 1e9 either
// way.
#pragma once

#include <filesystem>
#include <optional>

#include "host/deploy/config.hpp"

namespace flexor::deploy {

struct CalibrationDocument {
  std::string source;  // names it in errors
  std::string unit;    // of its values; empty: not given
  std::array<std::optional<Sensor>, kFingers> sensor;
};

// Throws io::InputError naming file and place.
CalibrationDocument load_calibration(const std::filesystem::path& path);
CalibrationDocument calibration_from_json(const std::string& text, const std::string& source);

// How each finger's counts become the model's input: through the calibration where it names the finger, else
// as they are for a model of counts, and through `alpha` for a model of the divider's alpha. Throws
// io::InputError for a model in any other unit, and where calibration and model are in different ones.
std::array<Sensor, kFingers> sensors_of(const model::Model& model, const Sensor& alpha,
                                        const CalibrationDocument& calibration);

// Takes its sensors' corrections (host/model/correction.hpp) out of a glove's model, and puts them into the tables of counts
// instead: the same lines, at no cost to the board.
void fold_corrections(Glove& glove);

}  // namespace flexor::deploy
