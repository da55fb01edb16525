// A deployment's wiring as pictures and as a page of text.
#pragma once

#include <filesystem>
#include <string>

#include "host/report/saved.hpp"

namespace flexor::report {

// The board with all that is wired to it. board: {"name", "board", "connections": [{"pin", "kind", "name", "how"}]}
// with kinds strip, joystick, button, potentiometer, motor, radio, usb; divider_kohm: between each sensor and 5
// V.
std::string wiring_svg(const Json& board, double divider_kohm);

// wiring_NAME.svg for each board, and wiring.md: divider, pins, parts. wiring: {"divider_kohm", "boards",
// "parts": [{"count", "what"}]}. Throws io::InputError.
void save_wiring(const Json& wiring, const std::filesystem::path& folder);

}  // namespace flexor::report
