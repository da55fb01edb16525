#include "host/deploy/wiring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexor::deploy {
namespace {

constexpr const char* kOffD0 = "off while flashing over USB";

// Of the hand's board, thumb to pinky: firmware/README.md.
constexpr std::array<int, kFingers> kMotorPwm = {9, 10, 11, 3, 5};
constexpr std::array<int, kFingers> kMotorDirection = {8, 12, 2, 4, 7};
constexpr int kMotorEnable = 6;

const std::string& finger(std::size_t i) { return model::finger_names()[i]; }

// A converter for USB drives D0, too.
void add_radio(std::vector<Connection>& out) {
  out.push_back({"D1", "radio", "HC-12 RXD", "VCC to 5 V, GND to GND"});
  out.push_back({"D0", "radio", "HC-12 TXD", kOffD0});
}

BoardWiring glove_board(const Pins& pins, Output output, double divider_kohm, const Sensed& sensed) {
  BoardWiring out{"glove", boards_with(pins), {}};
  for (std::size_t i = 0; i < kFingers; ++i) {
    if (!sensed[i]) continue;
    const std::string pin = fmt::format("A{}", pins.strip[i]);
    if (divider_kohm > 0) {
      out.connections.push_back(
          {pin, "strip", finger(i), fmt::format("sensor to GND, {:g} kOhm to 5 V", divider_kohm)});
    } else {
      out.connections.push_back({pin, "wiper", finger(i) + " potentiometer", "wiper; ends to 5 V and GND"});
    }
  }
  if (pins.joystick) {
    for (std::size_t i = 0; i < 2; ++i)
      out.connections.push_back({fmt::format("A{}", (*pins.joystick)[i]), "joystick",
                                 i == 0 ? "joystick x" : "joystick y", "ends to 5 V and GND"});
  }
  for (std::size_t i = 0; i < model::kButtons; ++i) {
    if (!pins.button[i]) continue;
    out.connections.push_back(
        {fmt::format("D{}", *pins.button[i]), "button", model::buttons()[i].meaning, "other end to GND"});
  }
  if (output == Output::radio) {
    add_radio(out.connections);
  } else {
    out.connections.push_back({"USB", "usb", "to the PC", "115200 baud"});
  }
  return out;
}

BoardWiring hand_board() {
  BoardWiring out{"hand", kAtmega328p.boards, {}};
  for (std::size_t i = 0; i < kFingers; ++i) {
    out.connections.push_back({fmt::format("A{}", i), "potentiometer", finger(i),
                               fmt::format("wiper; {:g} kOhm from the pin to GND", kPull_kohm)});
  }
  for (std::size_t i = 0; i < kFingers; ++i) {
    out.connections.push_back(
        {fmt::format("D{}", kMotorPwm[i]), "motor", finger(i) + " PWM", "motor driver"});
    out.connections.push_back({fmt::format("D{}", kMotorDirection[i]), "motor", finger(i) + " direction",
                               "motor driver, high flexes"});
  }
  out.connections.push_back(
      {fmt::format("D{}", kMotorEnable), "motor", "enable",
       fmt::format("all drivers' nSLEEP, STBY or EN, high runs; {:g} kOhm to GND", kEnablePull_kohm)});
  add_radio(out.connections);
  return out;
}

std::string board_part(const Pins& pins) {
  return fmt::format("{} ({}, 16 MHz, 5 V) with its USB cable", boards_with(pins), kAtmega328p.printed);
}

// The nearest of IEC 60063's series E96, three digits a decade; what is of E24 is sold as it is.
double nearest_sold(double kohm) {
  static constexpr std::array kOfE24Alone = {1.2, 1.6, 1.8, 2.2, 2.4, 2.7, 3.0, 3.3, 3.6,
                                             3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 8.2, 9.1};
  const double decade = std::pow(10, std::floor(std::log10(kohm)));
  const auto is_it = [&](double value) { return std::abs(kohm / decade - value) < 1e-9; };
  if (std::ranges::any_of(kOfE24Alone, is_it)) return kohm;
  double best = 0;
  for (int i = 0; i <= 96; ++i) {
    const double value = std::round(100 * std::pow(10, i / 96.0)) / 100 * decade;
    if (std::abs(value - kohm) < std::abs(best - kohm)) best = value;
  }
  return best;
}

std::string divider_part(double kohm) {
  std::string out = fmt::format("resistor {:g} kOhm, 1 %, one for each sensor", kohm);
  const double sold = nearest_sold(kohm);
  if (std::abs(sold / kohm - 1) < 1e-6) return out;
  return out + fmt::format(
                   "; the nearest that is sold (E96) is {0:g} kOhm: write it, or any other, into "
                   "hardware.json as divider.fixed_kohm",
                   sold);
}

std::vector<Part> parts_of(const Pins& pins, Output output, double divider_kohm, const Sensed& sensed) {
  const bool radio = output == Output::radio;
  const auto pressed = static_cast<int>(
      std::ranges::count_if(pins.button, [](const std::optional<int>& pin) { return pin.has_value(); }));
  const bool two_kinds = radio && boards_with(pins) != kAtmega328p.boards;
  std::vector<Part> out = {{radio && !two_kinds ? 2 : 1, board_part(pins)}};
  if (two_kinds) out.push_back({1, board_part({}) + ", for the hand"});
  const bool are_flex = divider_kohm > 0;
  const auto sensors = static_cast<int>(std::ranges::count(sensed, true));
  out.push_back({sensors, are_flex ? "flex sensor, one for each finger"
                                   : "potentiometer of 10 kOhm, one for each finger"});
  if (are_flex) out.push_back({sensors, divider_part(divider_kohm)});
  if (pins.joystick) out.push_back({1, "thumb joystick: two potentiometers of 10 kOhm"});
  if (pressed > 0) out.push_back({pressed, "push button that closes; the board has the pull-ups"});
  if (!radio) return out;
  out.insert(out.end(),
             {{2, "HC-12 radio module with its antenna"},
              {kFingers, "motor with its potentiometer, for the hand"},
              {3, "driver for two motors: PWM, direction, enable"},
              {kFingers, fmt::format("resistor {:g} kOhm, one for each potentiometer", kPull_kohm)},
              {1, fmt::format("resistor {:g} kOhm from the drivers' enable to GND", kEnablePull_kohm)},
              {1, "supply for the motors, its ground joined with the board's"}});
  return out;
}

}  // namespace

std::string boards_with(const Pins& pins) {
  const bool beyond_uno = std::ranges::any_of(model::scan_of(pins), [](int pin) { return pin > 5; });
  return beyond_uno ? "Arduino Nano" : kAtmega328p.boards;
}

WiringPlan wiring_plan(const model::Hardware& hardware, Output output, const Sensed& sensed) {
  WiringPlan out;
  if (hardware.sensor == model::SensorKind::flex) out.divider_kohm = hardware.divider_kohm;
  out.boards.push_back(glove_board(hardware.pins, output, out.divider_kohm, sensed));
  if (output == Output::radio) out.boards.push_back(hand_board());
  out.parts = parts_of(hardware.pins, output, out.divider_kohm, sensed);
  return out;
}

}  // namespace flexor::deploy
