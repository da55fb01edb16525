// A model into the pages of flash of a glove (runtime/core/flash_map.hpp), through the board's
// bootloader: the glove pauses while its flash is read and one copy is written, and starts with the new model.
#pragma once

#include "host/deploy/config.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/intel_hex.hpp"

namespace flexor::deploy {

// What is to be written over a board's flash, whose content this is: the copy that does not run, with the next
// generation. `name`: of the board, for errors. Throws io::InputError, one line with the mend, where the board has no
// settings of this version, or has another rate, calibration or key (where the glove has one: over USB none is needed), or the model is too large.
FlashContent pages_with_model(const FlashContent& content, const Glove& glove, const std::string& name);

}  // namespace flexor::deploy
