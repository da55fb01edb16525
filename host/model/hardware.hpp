// A real glove and hand as a document: sensors and divider, pins, radio; joints, motors, potentiometers and their loop. What is
// deployed comes from it, and the twin simulates it.
//
//   {"schema": "flexor-hardware", "schema_version": 1, "sensor": "flex" | "potentiometer",
//    "pins": {"thumb": "A0", ..., "joystick": ["A6", "A7"], "calibrate": "D12"},
//    "parameters": {NAME: {"value", "unit", "source"}, ...}}
// What is left out is that of the preset flexor; an unknown name is an error. numbers() is the list of parameters.
// docs/hardware.schema.json is its JSON Schema.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/model/number_table.hpp"

namespace flexor::model {

inline constexpr std::size_t kButtons = 5;

struct Button {
  const char* name;
  const char* meaning;  // of what it does in VR
  unsigned char bit;    // of link::glove_button
};
const std::array<Button, kButtons>& buttons();

// What is wired to the glove's board, by the numbers that are printed on it: A0 .. A7 of a Nano, an Uno has none beyond A5.
struct Pins {
  std::array<int, kFingers> strip{0, 1, 2, 3, 4};   // analog pin of each finger's sensor, thumb first
  std::optional<std::array<int, 2>> joystick;       // analog pins of x and y
  std::array<std::optional<int>, kButtons> button;  // digital pin, closed to ground when pressed
};

// Analog pins in the order that the board reads them: sensors thumb to pinky, then the joystick.
std::vector<int> scan_of(const Pins& pins);

// Sensors in dividers, or potentiometers, which are dividers of their own.
enum class SensorKind { flex, potentiometer };

nlohmann::ordered_json to_json(const Pins& pins);

// As it is: the preset flexor, the published glove and hand.
struct Hardware {
  std::string source = "flexor";  // names it in errors

  // glove
  SensorKind sensor = SensorKind::flex;
  Pins pins;
  double flat_kohm = 25.0;
  double kohm_per_deg = 100.0 / 180;
  double divider_kohm = 35.0;
  double reference_V = 5.0;
  double baud = 9600.0;
  double frame_rate_hz = 0.0;

  // hand
  PerFinger hand_lower_deg{90, 28, 28, 28, 28};
  PerFinger hand_upper_deg{170, 113, 113, 113, 113};
  double motor_V = 6.0;
  double resistance_ohm = 3.8;
  double torque_constant_mNm_A = 1.8;
  double gear_ratio = 150.0;
  double gear_efficiency = 0.55;
  double rotor_inertia_gcm2 = 0.05;
  double finger_inertia_gcm2 = 400.0;
  double current_limit_A = 1.2;
  double coulomb_mNm = 12.0;
  double viscous_mNms_rad = 1.0;
  double disturbance_mNm = 10.0;
  double potentiometer_range_deg = 250.0;
  double loop_proportional_per_deg = 0.05;
  double loop_integral_per_deg_s = 0.1218;
  double loop_integral_limit = 97.67;
  double loop_lower_deg = 0.0;
  double loop_upper_deg = 180.0;
  double loop_speed_deg_s = 800.0;
  double loop_duty = 1.0;
  double loop_feed_forward_s_per_deg = 0.0;

  // Of the motors, behind their gears. 1 g cm^2 = 1e-7 kg m^2 = 1e-4 mNm s^2
  double torque_mNm_A() const { return torque_constant_mNm_A * gear_ratio * gear_efficiency; }
  double back_emf_Vs() const { return torque_constant_mNm_A / 1000 * gear_ratio; }
  double inertia_mNms2() const {
    return (rotor_inertia_gcm2 * gear_ratio * gear_ratio + finger_inertia_gcm2) * 1e-4;
  }
};

// Those of a const one are to be read alone.
Numbers numbers(Hardware& hardware);
Numbers numbers(const Hardware& hardware);

// All below throw io::InputError, one line naming the source and the key.

// flexor, or lucidgloves: OpenGloves' usual pins and potentiometers.
Hardware preset(const std::string& name);
// A preset, or else a file.
Hardware hardware(const std::string& preset_or_file);
Hardware hardware_of(const nlohmann::ordered_json& document, const std::string& source);
nlohmann::ordered_json to_json(const Hardware& hardware);
nlohmann::ordered_json hardware_schema();
// Ranges, and the rules that two of its members may break: each lower limit is below each upper one, of hand and loop, and no pin
// has two users.
void check(const Hardware& hardware);

}  // namespace flexor::model
