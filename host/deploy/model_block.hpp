// A model in fixed point as bytes for the board's interpreter (runtime/compensator/graph.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/deploy/config.hpp"
#include "runtime/glove/flash_model.hpp"

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

// Throws io::InputError, with the mend, where a board (`name`, for errors) samples at another rate than the model, or was
// made for another calibration of a strip that the model has; calibration: of kFingers strips.
void check_made_for(const Glove& glove, int rate_hz, const std::uint16_t* calibration,
                    const std::string& name);

// As one part, or in as many as there are fingers: then a finger is replaced at a time, and what several share is in
// each. Only what moves a motor is in them. Throws io::InputError where the model does not fit fixed point, or has what a
// block cannot say.
ModelBlock model_block(const Glove& glove, int parts);

// RAM of the board that the interpreter may use: for a model in EEPROM, which it copies there, and for the states of one
// in flash.
inline constexpr int kArenaBytes = 760;
inline constexpr int kFlashArenaBytes = 600;
// Of the model's two copies in flash each.
inline constexpr int kCopyBytes = 2560;

// Where an ATmega328P keeps a model so that a swap is whole or not at all: in EEPROM, in one part where two fit, or a
// finger at a time; or, for models too large for that, in pages of flash, whole.
struct DataBlock {
  ModelBlock block;
  bool in_flash = false;
};

// Throws io::InputError where it fits nowhere.
DataBlock data_block(const Glove& glove);

inline constexpr std::string_view kModelMagic = "FLXMDL01";
std::uint16_t crc_of(const glove::ModelRecord& record);

// As pages of flash, see runtime/glove/flash_model.hpp: what a part must have been made for, and a copy of a model with
// its generation. Throws io::InputError where it is too large.
glove::ModelRecord model_record(const Glove& glove, std::uint16_t image);
Bytes model_copy(const ModelBlock& block, std::uint16_t image, std::uint16_t generation);

}  // namespace flexor::deploy
