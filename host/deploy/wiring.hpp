// What a user solders: each pin with what belongs on it, and the parts; and the sketch that logs the sensors.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/deploy/config.hpp"
#include "host/io/pipe_json.hpp"

namespace flexor::deploy {

// Pull resistor of each of the hand's potentiometers: a wiper that came off reads a rail, not its neighbour.
inline constexpr double kPull_kohm = 100;
// Of the drivers' enable: a board without a program leaves the motors limp, also against a driver's own pull-up.
inline constexpr double kEnablePull_kohm = 4.7;

struct Connection {
  std::string pin;   // as printed on the board
  std::string kind;  // strip, joystick, button, potentiometer, motor, radio, usb: how it is drawn
  std::string name;
  std::string how;  // the other ends and parts, in a few words
};

struct Part {
  int count;
  std::string what;
};

struct BoardWiring {
  std::string name;   // glove, hand
  std::string board;  // that may be there
  std::vector<Connection> connections;
};

struct WiringPlan {
  std::vector<BoardWiring> boards;
  std::vector<Part> parts;
  double divider_kohm = 0;  // between a sensor and 5 V; 0: potentiometers, dividers of their own
};

// Boards with these pins: only a Nano has A6 and A7.
std::string boards_with(const Pins& pins);

// The fingers with a sensor.
using Sensed = std::array<bool, kFingers>;
inline constexpr Sensed kAllSensed = {true, true, true, true, true};

// A hand's board comes with output radio.
WiringPlan wiring_plan(const model::Hardware& hardware, Output output, const Sensed& sensed = kAllSensed);

FLEXOR_PIPE(Connection, pin, kind, name, how)
FLEXOR_PIPE(BoardWiring, name, board, connections)
FLEXOR_PIPE(Part, count, what)
FLEXOR_PIPE(WiringPlan, divider_kohm, boards, parts)

}  // namespace flexor::deploy
