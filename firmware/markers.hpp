// Milestones that the firmware writes to GPIOR0, a register without a function: two cycles each, seen by a
// simulator or a debugger.
#pragma once

#include <stdint.h>

namespace flexor {
namespace firmware {

enum class Marker : uint8_t {
  step_begin = 1,  // glove: compensator
  step_end = 2,
  sampled = 3,       // glove: all sensors read
  frame_sealed = 4,  // glove: a frame or a line goes to the UART
  tick_begin = 5,    // hand: position loops
  tick_end = 6,
  frame_accepted = 7,  // hand: a frame is trusted
};

}  // namespace firmware
}  // namespace flexor
