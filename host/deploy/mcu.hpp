// The microcontrollers that there is firmware for, and what of them a user meets: boards, pins, bootloader.
#pragma once

#include <string>

#include "host/deploy/intel_hex.hpp"
#include "host/deploy/pins.hpp"

namespace flexor::deploy {

// Flash without its bootloader's.
struct Mcu {
  const char* name;
  int flash_bytes;
  int ram_bytes;
  const char* printed;    // as its maker writes it
  const char* boards;     // that have it
  const char* part;       // as avrdude calls it
  const char* signature;  // that its bootloader says
  int analog_pins;
};
inline constexpr Mcu kAtmega328p = {"atmega328p",          32768,   2048,       "ATmega328P",
                                    "Arduino Nano or Uno", "m328p", "0x1e950f", 8};
// The glove alone.
inline constexpr Mcu kAtmega32u4 = {
    "atmega32u4", 28672, 2560, "ATmega32U4", "Arduino Leonardo, Micro or Pro Micro", "m32u4", "0x1e9587", 12};

bool is_32u4(const Mcu& mcu);

// What writes an ATmega32U4's image through its own bootloader, which is there for eight seconds after a reset.
std::string avr109_command(const std::string& hex);

// Throws io::InputError, which names those that are known.
Mcu mcu(const std::string& name);

// Whose image this is: the vectors at its begin are a chip's, 26 jumps of an ATmega328P or 43 of an ATmega32U4 (their
// datasheets, "Interrupt vectors").
Mcu mcu_of(const FlashContent& image);

// A digital pin, D2 to D12: its port and bit.
struct PortBit {
  char port;
  int bit;
};
PortBit port_bit(const Mcu& mcu, int digital_pin);

// Throws io::InputError, one line: an analog pin that the chip lacks; one pin under two names, as D4 of an ATmega32U4
// is its A6.
void require_pins_of(const Mcu& mcu, const Pins& pins);

}  // namespace flexor::deploy
