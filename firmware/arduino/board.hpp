// In place of the firmware's own board.hpp, for boards that the Arduino IDE knows: no registers, no markers.
#pragma once

#include <stdint.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#endif
#ifndef PROGMEM
#define PROGMEM
#endif

#include "firmware/markers.hpp"

namespace flexor {
namespace firmware {

inline void mark(Marker) {}

}  // namespace firmware
}  // namespace flexor
