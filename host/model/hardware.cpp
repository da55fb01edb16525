#include "host/model/hardware.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/io/json.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::model {
namespace {

using io::InputError;

constexpr const char* kHardwareSchema = "flexor-hardware";
constexpr int kHardwareVersion = 1;
constexpr const char* kEquation1 = "Sensors 2019, 19(18), 3896, eq. 1";
constexpr const char* kSection2 = "Sensors 2019, 19(18), 3896, section 2";
constexpr const char* kSection31 = "Sensors 2019, 19(18), 3896, section 3.1";

struct PinRange {
  char letter;
  int first;
  int last;
  const char* rule;
};
constexpr PinRange kAnalog = {'A', 0, 7, "an analog pin is A0 to A7"};
constexpr PinRange kDigital = {
    'D', 2, 12, "a button's pin is D2 to D12; D0 and D1 are the serial port, D13 has the board's LED"};

std::string pin_text(const PinRange& range, int pin) { return fmt::format("{}{}", range.letter, pin); }

int pin_of(const Json& json, const PinRange& range, const std::string& name) {
  const std::string text = json.is_string() ? json.get<std::string>() : "";
  for (int pin = range.first; pin <= range.last; ++pin) {
    if (text == pin_text(range, pin)) return pin;
  }
  throw InputError("pins: {}: {}: {}", name, io::dump_line(json), range.rule);
}

// Each pin that is in use, with the first user; two users of one are an error.
void check_pins(const Pins& pins) {
  std::map<std::string, std::string> users;
  const auto use = [&](const PinRange& range, int pin, const std::string& name) {
    const auto [user, is_new] = users.emplace(pin_text(range, pin), name);
    if (!is_new)
      throw InputError("pins: {} and {} are both on {}: give each a pin of its own", user->second, name,
                       user->first);
  };
  for (std::size_t i = 0; i < kFingers; ++i) use(kAnalog, pins.strip[i], finger_names()[i]);
  for (std::size_t i = 0; pins.joystick && i < 2; ++i)
    use(kAnalog, (*pins.joystick)[i], i == 0 ? "joystick x" : "joystick y");
  for (std::size_t i = 0; i < kButtons; ++i) {
    if (pins.button[i]) use(kDigital, *pins.button[i], buttons()[i].name);
  }
}

Pins read_pins(const Json& json) {
  io::JsonReader reader(json, "pins");
  Pins pins;
  for (std::size_t i = 0; i < kFingers; ++i) {
    const std::string& name = finger_names()[i];
    if (reader.has(name.c_str())) pins.strip[i] = pin_of(json.at(name), kAnalog, name);
  }
  if (reader.has("joystick")) {
    const Json& both = reader.list("joystick");
    if (both.size() != 2) reader.fail(R"(joystick: give the pins of x and y, as in ["A6", "A7"])");
    pins.joystick = {pin_of(both[0], kAnalog, "joystick"), pin_of(both[1], kAnalog, "joystick")};
  }
  for (std::size_t i = 0; i < kButtons; ++i) {
    const char* name = buttons()[i].name;
    if (reader.has(name)) pins.button[i] = pin_of(json.at(name), kDigital, name);
  }
  reader.done();
  return pins;
}

Json pins_schema() {
  const auto one_of = [](const PinRange& range) {
    Json out = Json::array();
    for (int pin = range.first; pin <= range.last; ++pin) out.push_back(pin_text(range, pin));
    return Json{{"enum", std::move(out)}};
  };
  Json out = Json::object();
  for (const std::string& name : finger_names()) out[name] = one_of(kAnalog);
  out["joystick"] = {{"type", "array"}, {"items", one_of(kAnalog)}, {"minItems", 2}, {"maxItems", 2}};
  for (const Button& b : buttons()) out[b.name] = one_of(kDigital);
  return {{"type", "object"}, {"properties", std::move(out)}, {"additionalProperties", false}};
}

const std::array<const char*, 2> kSensorKinds = {"flex", "potentiometer"};

SensorKind sensor_kind(const std::string& name) {
  const auto it = std::ranges::find(kSensorKinds, name);
  if (it == kSensorKinds.end())
    throw InputError("\"sensor\" is \"{}\"; it must be flex or potentiometer", name);
  return static_cast<SensorKind>(it - kSensorKinds.begin());
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

std::vector<int> scan_of(const Pins& pins) {
  std::vector<int> out(pins.strip.begin(), pins.strip.end());
  if (pins.joystick) out.insert(out.end(), pins.joystick->begin(), pins.joystick->end());
  return out;
}

Json to_json(const Pins& pins) {
  Json out = Json::object();
  for (std::size_t i = 0; i < kFingers; ++i) out[finger_names()[i]] = pin_text(kAnalog, pins.strip[i]);
  if (pins.joystick)
    out["joystick"] = {pin_text(kAnalog, (*pins.joystick)[0]), pin_text(kAnalog, (*pins.joystick)[1])};
  for (std::size_t i = 0; i < kButtons; ++i) {
    if (pins.button[i]) out[buttons()[i].name] = pin_text(kDigital, *pins.button[i]);
  }
  return out;
}

// clang-format off
Numbers numbers(Hardware& h) {
  return {
      {"divider.flat_kohm", h.flat_kohm, 0.001, 1e6, "kohm", kEquation1},
      {"divider.kohm_per_deg", h.kohm_per_deg, 1e-6, 1e6, "kohm/deg", kEquation1},
      {"divider.fixed_kohm", h.divider_kohm, 0.001, 1e6, "kohm", kSection2},
      {"divider.reference_V", h.reference_V, 0.1, 50, "V", kSection2},
      {"radio.baud", h.baud, 1, 1e7, "1/s", "HC-12 data sheet, default"},
      {"radio.frame_rate_hz", h.frame_rate_hz, 0, 1000, "Hz", "choice: 0 sends each sample"},
      {"hand.lower_deg", h.hand_lower_deg, 0, 180, "deg", kSection31},
      {"hand.upper_deg", h.hand_upper_deg, 0, 180, "deg", kSection31},
      {"motor.supply_V", h.motor_V, 0.1, 100, "V", "data sheets of 10 x 12 mm gear motors, 6 V, 150:1"},
      {"motor.resistance_ohm", h.resistance_ohm, 0.01, 1e4, "ohm", "the same: stall current 1.6 A"},
      {"motor.torque_constant_mNm_A", h.torque_constant_mNm_A, 1e-3, 1e4, "mNm/A", "the same: no-load speed 200 rpm behind the gear"},
      {"motor.gear_ratio", h.gear_ratio, 1, 1e4, "1", "the same"},
      {"motor.gear_efficiency", h.gear_efficiency, 0.01, 1, "1", "the same: stall torque 235 mNm"},
      {"motor.rotor_inertia_gcm2", h.rotor_inertia_gcm2, 1e-4, 1e4, "g cm^2", "choice: an iron rotor of 3 g and 6 mm"},
      {"motor.finger_inertia_gcm2", h.finger_inertia_gcm2, 0, 1e6, "g cm^2", "choice: 30 g at 3.6 cm"},
      {"motor.current_limit_A", h.current_limit_A, 0.01, 100, "A", "choice: a two-channel driver of that size"},
      {"motor.coulomb_mNm", h.coulomb_mNm, 0, 1e4, "mNm", "choice: 5 % of the stall torque, behind the gear"},
      {"motor.viscous_mNms_rad", h.viscous_mNms_rad, 0, 1e4, "mNm s/rad", "choice: a tenth of what the motor's own induction brakes"},
      {"motor.disturbance_mNm", h.disturbance_mNm, 0, 1e4, "mNm", "choice: bound of d_in; the article gives no size"},
      {"potentiometer.range_deg", h.potentiometer_range_deg, 180, 255, "deg", "choice: 10-bit reading over this range"},
      {"loop.proportional_per_deg", h.loop_proportional_per_deg, 0, 0.99, "1/deg", "choice: full duty at 20 degrees, as quick as the motor allows; the published errors leave the hand about 20 ms"},
      {"loop.integral_per_deg_s", h.loop_integral_per_deg_s, 0, 3.9, "1/(deg s)", "fitted: docs/adr/0005"},
      {"loop.integral_limit", h.loop_integral_limit, 0, 120, "1", "fitted: docs/adr/0005; in full duties. The article names no anti-windup"},
      {"loop.lower_deg", h.loop_lower_deg, 0, 180, "deg", "choice: the article limits the joint (eq. 6), not the command"},
      {"loop.upper_deg", h.loop_upper_deg, 0, 180, "deg", "choice: the article limits the joint (eq. 6), not the command"},
      {"loop.speed_deg_s", h.loop_speed_deg_s, 1, 100000, "deg/s", "choice: ten times the speed of the gestures"},
      {"loop.duty", h.loop_duty, 0.01, 1, "1", "choice: the whole supply"},
      {"loop.feed_forward_s_per_deg", h.loop_feed_forward_s_per_deg, 0, 0.00099, "s/deg", "choice: none; the article names a PI controller"},
  };
}
// clang-format on

Numbers numbers(const Hardware& hardware) { return numbers(const_cast<Hardware&>(hardware)); }

void check(const Hardware& h) {
  check(numbers(h));
  for (std::size_t i = 0; i < kFingers; ++i) {
    for (const auto& [lower, lower_deg] :
         {std::pair("hand.lower_deg", h.hand_lower_deg[i]), std::pair("loop.lower_deg", h.loop_lower_deg)}) {
      for (const auto& [upper, upper_deg] : {std::pair("hand.upper_deg", h.hand_upper_deg[i]),
                                             std::pair("loop.upper_deg", h.loop_upper_deg)}) {
        if (!(lower_deg < upper_deg))
          throw InputError("{}: {}, {:g}, must be below {}, {:g}", finger_names()[i], lower, lower_deg, upper,
                           upper_deg);
      }
    }
  }
  check_pins(h.pins);
}

Hardware preset(const std::string& name) {
  Hardware out;
  if (name == "flexor") return out;
  if (name != "lucidgloves")
    throw InputError("{}: is no file, nor a hardware preset; those are flexor and lucidgloves", name);
  out.source = name;
  out.sensor = SensorKind::potentiometer;
  std::ranges::reverse(out.pins.strip);
  return out;
}

Hardware hardware(const std::string& preset_or_file) {
  std::error_code error;
  // A preset's name is one, whatever lies in the working folder.
  const bool is_preset = preset_or_file == "flexor" || preset_or_file == "lucidgloves";
  if (is_preset || !std::filesystem::exists(preset_or_file, error)) return preset(preset_or_file);
  return hardware_of(io::parse_json(io::read_document(preset_or_file), preset_or_file), preset_or_file);
}

Hardware hardware_of(const Json& document, const std::string& source) {
  io::JsonReader reader(document, source);
  reader.schema(kHardwareSchema, kHardwareVersion);
  Hardware out;
  out.source = source;
  try {
    if (reader.has("sensor")) out.sensor = sensor_kind(reader.text("sensor"));
    out.pins = read_pins(reader.object_or_empty("pins"));
    read(reader.object_or_empty("parameters"), numbers(out));
    reader.done();
    check(out);
  } catch (const InputError& error) {
    io::fail_within(source, error);
  }
  return out;
}

Json to_json(const Hardware& hardware) {
  return {{"schema", kHardwareSchema},
          {"schema_version", kHardwareVersion},
          {"sensor", kSensorKinds.at(static_cast<std::size_t>(hardware.sensor))},
          {"pins", to_json(hardware.pins)},
          {"parameters", to_json(numbers(hardware))}};
}

Json hardware_schema() {
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"title", "Hardware document of Flexor"},
          {"type", "object"},
          {"properties",
           {{"schema", {{"const", kHardwareSchema}}},
            {"schema_version", {{"const", kHardwareVersion}}},
            {"sensor", {{"enum", kSensorKinds}}},
            {"pins", pins_schema()},
            {"parameters", schema_of(numbers(Hardware()))}}},
          {"required", {"schema", "schema_version"}},
          {"additionalProperties", false}};
}

}  // namespace flexor::model
