// What is wired to the glove's board: one table, which firmware, logging sketch, picture and report are made
// from.
//
// Pins have the numbers that are printed on the board: A0 .. A7 of a Nano, an Uno has none beyond A5.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/model/wiring.hpp"

namespace flexor::deploy {

inline constexpr std::size_t kButtons = 5;

struct Button {
  const char* name;
  const char* says;   // of what it does in VR
  unsigned char bit;  // of link::glove_button
};
const std::array<Button, kButtons>& buttons();

struct Pins {
  std::array<int, model::kFingers> strip{0, 1, 2, 3, 4};  // analog pin of each finger's strip, thumb first
  std::optional<std::array<int, 2>> joystick;             // analog pins of x and y
  std::array<std::optional<int>, kButtons> button;        // digital pin, closed to ground when pressed
};

// "lucidgloves", "thumb=A4,index=A3",
// "lucidgloves,joystick=A6+A7,joystick_button=D7,a=D8,b=D9,menu=D10,calibrate=D12": a preset, or the preset
// "flexor" where none is named, with changes. flexor: thumb A0 .. pinky A4, lucidgloves the other way round.
// Throws io::InputError.
Pins pins_from_text(const std::string& text);
std::string to_text(const Pins& pins);

// Analog pins in the order that the board reads them: strips thumb to pinky, then the joystick.
std::vector<int> scan_of(const Pins& pins);

}  // namespace flexor::deploy
