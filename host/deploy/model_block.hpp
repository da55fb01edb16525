// A model in fixed point as bytes for the board's interpreter (runtime/compensator/graph.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "host/deploy/config.hpp"
#include "host/deploy/intel_hex.hpp"

namespace flexor::deploy {

struct ModelBlock {
  Bytes bytes;
  int state_bytes = 0;  // RAM that the interpreter needs on the microcontroller beside them
  int moved_bytes = 0;  // of them in RAM, where they lie in flash
};

// Identifies a sensor: the CRC-16 of its calibration table. Zero for a sensor that is not there.
std::array<std::uint16_t, kFingers> calibration_ids(const GloveTables& tables);

// Throws io::InputError, with the mend, where a board (`name`, for errors) samples at another rate than the model, or was
// made for another calibration of a sensor that the model has; calibration: of kFingers sensors.
void check_made_for(const Glove& glove, int rate_hz, const std::uint16_t* calibration,
                    const std::string& name);

// Only what leaves the glove is in it (outputs_of). Throws io::InputError where the model does not fit fixed point, or has what
// a block cannot hold.
ModelBlock model_block(const Glove& glove);

// The larger share of a glove's flash and RAM that the model takes on the hand, whatever its sensors are; 0 where it is no board's.
double share_of_room(const model::Model& model);

// Whether it can be sent while the glove runs.
bool fits_eeprom(const Glove& glove);

// The model as a glove's flash holds it. Throws io::InputError where it does not fit, by how much.
Bytes flash_block(const Glove& glove);

}  // namespace flexor::deploy
