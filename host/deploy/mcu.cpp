#include "host/deploy/mcu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

// Of an ATmega32U4, pins_arduino.h of the Arduino core's Leonardo: analog pin and the digital one that it is, too.
constexpr std::array<std::pair<int, int>, 6> kSamePin = {
    {{6, 4}, {7, 6}, {8, 8}, {9, 9}, {10, 10}, {11, 12}}};

}  // namespace

std::string avr109_command(const std::string& hex) {
  return fmt::format("avrdude -c avr109 -p m32u4 -P PORT -U flash:w:{}:i", hex);
}

bool is_32u4(const Mcu& mcu) { return std::string_view(mcu.name) == kAtmega32u4.name; }

Mcu mcu(const std::string& name) {
  for (const Mcu& known : {kAtmega328p, kAtmega32u4}) {
    if (name == known.name) return known;
  }
  throw InputError(
      fmt::format("unknown target \"{}\"; known: {}, {}", name, kAtmega328p.name, kAtmega32u4.name));
}

Mcu mcu_of(const FlashContent& image) {
  constexpr std::size_t kVectors32u4 = 43;
  const auto word = [&](std::size_t at) {
    return at + 2 <= image.bytes.size() ? image.bytes[at] + 256U * image.bytes[at + 1] : 0xffffU;
  };
  // jmp, or rjmp and nop where the linker saw that it reaches.
  const auto jumps = [&](std::size_t vector) {
    const std::size_t at = image.begin + 4 * vector;
    return (word(at) & 0xfffe) == 0x940c || ((word(at) & 0xf000) == 0xc000 && word(at + 2) == 0);
  };
  for (std::size_t k = 0; k < kVectors32u4; ++k) {
    if (!jumps(k)) return kAtmega328p;
  }
  return kAtmega32u4;
}

PortBit port_bit(const Mcu& mcu, int digital_pin) {
  static constexpr std::array<PortBit, 13> k32u4 = {{{'D', 2},
                                                     {'D', 3},
                                                     {'D', 1},
                                                     {'D', 0},
                                                     {'D', 4},
                                                     {'C', 6},
                                                     {'D', 7},
                                                     {'E', 6},
                                                     {'B', 4},
                                                     {'B', 5},
                                                     {'B', 6},
                                                     {'B', 7},
                                                     {'D', 6}}};
  if (is_32u4(mcu)) return k32u4.at(static_cast<std::size_t>(digital_pin));
  if (digital_pin < 8) return {'D', digital_pin};
  return {'B', digital_pin - 8};
}

void require_pins_of(const Mcu& mcu, const Pins& pins) {
  const std::vector<int> scan = scan_of(pins);
  const int last = std::ranges::max(scan);
  if (last >= mcu.analog_pins) {
    throw InputError(fmt::format("--pins: A{}: an {} has A0 to A{}", last, mcu.printed, mcu.analog_pins - 1));
  }
  if (!is_32u4(mcu)) return;
  for (const auto& [analog, digital] : kSamePin) {
    if (std::ranges::find(scan, analog) == scan.end()) continue;
    if (std::ranges::find(pins.button, std::optional(digital)) == pins.button.end()) continue;
    throw InputError(fmt::format("--pins: A{} and D{} are one pin of an {}: give each a pin of its own",
                                 analog, digital, mcu.printed));
  }
}

}  // namespace flexor::deploy
