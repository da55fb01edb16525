// A glove's own calibration as a document.
//
// {"schema": "flexor-calibration", "schema_version": 1,
//  "fingers": {"thumb": {"counts": [430, 700], "value": [20, 140]}, ...}}
// value is in the model's input unit. Two points are a line, more a curve; both go on straight beyond their
// ends.
#pragma once

#include <filesystem>

#include "host/deploy/config.hpp"

namespace flexor::deploy {

// Sensors of the fingers that the file names; others keep `otherwise`. Throws io::InputError.
std::array<Sensor, kFingers> load_calibration(const std::filesystem::path& path,
                                              std::array<Sensor, kFingers> otherwise);

}  // namespace flexor::deploy
