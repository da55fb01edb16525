// The glove's signal chain and link as a library for any board of the Arduino IDE, not only for an ATmega328P.
#pragma once

#include <filesystem>

#include "host/deploy/config.hpp"

namespace flexor::deploy {

// Writes library.properties, README.md, src/ with Flexor.h, the runtime and the glove's data, and
// examples/ for the radio or for VR drivers. Frames are plain where `glove` has no key. Throws io::InputError.
void write_arduino_library(const Glove& glove, const std::filesystem::path& folder);

}  // namespace flexor::deploy
