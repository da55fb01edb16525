// A model in fixed point as bytes for the board's interpreter (runtime/compensator/graph.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/deploy/config.hpp"

namespace flexor::deploy {

using Bytes = std::vector<std::uint8_t>;

// Where the board keeps them: in RAM, loaded from EEPROM; or in flash, with slopes and scales beside the values.
struct ModelBlock {
  std::vector<Bytes> parts;
  int state_bytes = 0;  // RAM that Graph needs on the microcontroller beside the parts
  int largest() const;  // bytes of the largest part
  int bytes() const;    // of all
};

// What tells one strip's sensor from another: CRC-16 of its calibration table. Zero for a strip that is not there.
std::array<std::uint16_t, kFingers> calibration_ids(const GloveTables& tables);

// As one part, or in as many as there are fingers: then a finger is replaced at a time, and what several share is in
// each. Only what moves a motor is in them. Throws io::InputError where the model does not fit fixed point, or has what a
// block cannot say.
ModelBlock model_block(const Glove& glove, int parts);

// RAM of the board that the interpreter may use.
inline constexpr int kArenaBytes = 820;

// As an ATmega328P keeps it in EEPROM so that a swap is whole or not at all: in one part where two fit, else a finger at
// a time. Throws io::InputError where neither does.
ModelBlock storable_block(const Glove& glove);

}  // namespace flexor::deploy
