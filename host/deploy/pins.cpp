#include "host/deploy/pins.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "host/deploy/mcu.hpp"
#include "host/io/io.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

constexpr int kFirstDigital = 2;
constexpr int kLastDigital = 12;
constexpr const char* kJoystick = "joystick";

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) out.push_back(part);
  return out;
}

// "A4", "D12": the number behind the letter, where it is within the limits.
std::optional<int> number_of(const std::string& pin, char letter, int first, int last) {
  const bool digits = pin.size() >= 2 && pin.size() <= 3 &&
                      std::all_of(pin.begin() + 1, pin.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits || (pin[0] != letter && pin[0] != letter - 'A' + 'a')) return std::nullopt;
  const int number = std::stoi(pin.substr(1));
  if (number < first || number > last) return std::nullopt;
  return number;
}

int analog_of(const std::string& name, const std::string& pin) {
  if (const auto channel = number_of(pin, 'A', 0, kAtmega328p.analog_pins - 1)) return *channel;
  throw InputError(fmt::format("--pins: {}={}: an analog pin is A0 to A7", name, pin));
}

int digital_of(const std::string& name, const std::string& pin) {
  if (const auto number = number_of(pin, 'D', kFirstDigital, kLastDigital)) return *number;
  throw InputError(
      fmt::format("--pins: {}={}: a button's pin is D2 to D12; D0 and D1 are the serial port, D13 has the "
                  "board's LED",
                  name, pin));
}

std::array<int, 2> joystick_of(const std::string& pins) {
  const std::vector<std::string> both = split(pins, '+');
  if (both.size() != 2)
    throw InputError(
        fmt::format("--pins: joystick={}: give the pins of x and y, as in joystick=A6+A7", pins));
  return {analog_of(kJoystick, both[0]), analog_of(kJoystick, both[1])};
}

std::optional<Pins> preset_of(const std::string& name) {
  Pins pins;
  if (name == "flexor") return pins;
  if (name != "lucidgloves") return std::nullopt;
  std::ranges::reverse(pins.strip);
  return pins;
}

void set(Pins& pins, const std::string& name, const std::string& pin) {
  const std::vector<std::string>& fingers = model::finger_names();
  const auto finger = std::ranges::find(fingers, name);
  if (finger != fingers.end()) {
    pins.strip[static_cast<std::size_t>(finger - fingers.begin())] = analog_of(name, pin);
    return;
  }
  if (name == kJoystick) {
    pins.joystick = joystick_of(pin);
    return;
  }
  const auto button = std::ranges::find_if(buttons(), [&](const Button& b) { return name == b.name; });
  if (button != buttons().end()) {
    pins.button[static_cast<std::size_t>(button - buttons().begin())] = digital_of(name, pin);
    return;
  }
  std::vector<std::string> known = fingers;
  known.emplace_back(kJoystick);
  for (const Button& b : buttons()) known.emplace_back(b.name);
  throw InputError(fmt::format("--pins: unknown \"{}\"; known: flexor, lucidgloves, or PIN for {}", name,
                               fmt::join(known, ", ")));
}

// Each wired thing with its pin, as the table and its errors name them.
std::vector<std::pair<std::string, std::string>> wired(const Pins& pins) {
  std::vector<std::pair<std::string, std::string>> out;
  for (std::size_t i = 0; i < pins.strip.size(); ++i)
    out.emplace_back(model::finger_names()[i], fmt::format("A{}", pins.strip[i]));
  if (pins.joystick) {
    out.emplace_back("joystick x", fmt::format("A{}", (*pins.joystick)[0]));
    out.emplace_back("joystick y", fmt::format("A{}", (*pins.joystick)[1]));
  }
  for (std::size_t i = 0; i < kButtons; ++i) {
    if (pins.button[i]) out.emplace_back(buttons()[i].name, fmt::format("D{}", *pins.button[i]));
  }
  return out;
}

void refuse_doubles(const Pins& pins) {
  std::map<std::string, std::string> user;
  for (const auto& [name, pin] : wired(pins)) {
    const auto [other, is_new] = user.emplace(pin, name);
    if (is_new) continue;
    throw InputError(fmt::format("--pins: {} and {} are both on {}: give each a pin of its own",
                                 other->second, name, pin));
  }
}

}  // namespace

const std::array<Button, kButtons>& buttons() {
  namespace button = link::glove_button;
  static constexpr std::array<Button, kButtons> all = {{{"joystick_button", "joystick", button::kJoystick},
                                                        {"a", "A", button::kA},
                                                        {"b", "B", button::kB},
                                                        {"menu", "menu", button::kMenu},
                                                        {"calibrate", "calibrate", button::kCalibrate}}};
  return all;
}

Pins pins_from_text(const std::string& text) {
  const std::vector<std::string> items = split(text, ',');
  if (items.empty()) throw InputError("--pins: is empty; try --pins lucidgloves");
  Pins pins;
  std::vector<std::string> named;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto preset = preset_of(items[i]);
    if (preset && i == 0) {
      pins = *preset;
      continue;
    }
    const std::size_t equals = items[i].find('=');
    const std::string name = items[i].substr(0, equals);
    if (std::ranges::find(named, name) != named.end())
      throw InputError(fmt::format("--pins: {} comes twice", name));
    named.push_back(name);
    set(pins, name, equals == std::string::npos ? "" : items[i].substr(equals + 1));
  }
  refuse_doubles(pins);
  return pins;
}

std::string to_text(const Pins& pins) {
  std::vector<std::string> out;
  for (const auto& [name, pin] : wired(pins)) {
    if (name == "joystick y") {
      out.back() += "+" + pin;
      continue;
    }
    out.push_back(fmt::format("{}={}", name == "joystick x" ? kJoystick : name, pin));
  }
  return fmt::format("{}", fmt::join(out, ","));
}

std::vector<int> scan_of(const Pins& pins) {
  std::vector<int> out(pins.strip.begin(), pins.strip.end());
  if (pins.joystick) out.insert(out.end(), pins.joystick->begin(), pins.joystick->end());
  return out;
}

}  // namespace flexor::deploy
