// What can be wrong with a finger and with the hand's board: a code of each finger, bits of the board.
// README.md of this room has the table: what the hand does, and how a fault ends.
#pragma once

#include <stdint.h>

namespace flexor {
namespace hand {

// A finger has one at a time; with any of them its motor is off.
enum class Fault : uint8_t {
  none = 0,
  stalled = 1,   // the motor must have moved it, and the reading stands still: held, or at a stop
  blind = 2,     // the reading is outside of what the joint can reach
  frozen = 3,    // stalled both ways, without a movement in between
  slipped = 4,   // the reading moved without the motor
  reversed = 5,  // the reading moves against the motor
  floating = 6,  // the reading follows its neighbour's to the count
  noisy = 7,     // the reading jumps
};

// Of the board, a bit each: hand_status.board.
enum BoardFault : uint8_t {
  kSupplyDip = 1 << 0,      // the supply has fallen; all motors are off
  kAdcStuck = 1 << 1,       // a scan of the potentiometers did not end; all motors are off
  kBrownOutReset = 1 << 2,  // the last start was the brown-out detector's
  kWatchdogReset = 1 << 3,  // the last start was the watchdog's
  kRunaway = 1 << 4,  // a finger ran on although its motor was off; the drivers are off until the next start
};

}  // namespace hand
}  // namespace flexor
