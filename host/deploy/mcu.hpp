// The microcontroller that there is firmware for, and what of it a user meets: boards, pins, bootloader.
#pragma once

namespace flexor::deploy {

// Flash without its bootloader's.
struct Mcu {
  const char* name;
  int flash_bytes;
  int ram_bytes;
  const char* printed;    // as its maker writes it
  const char* boards;     // that have it
  const char* part;       // as avrdude calls it
  const char* signature;  // that its bootloader reports
};
inline constexpr Mcu kAtmega328p = {"atmega328p",          32768,   2048,      "ATmega328P",
                                    "Arduino Nano or Uno", "m328p", "0x1e950f"};

}  // namespace flexor::deploy
