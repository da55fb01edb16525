#include "host/twin/parameters.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/model.hpp"

namespace flexor::twin {
namespace {

using Json = nlohmann::ordered_json;
using io::InputError;
using P = Parameters;

constexpr const char* kSchema = "flexor-twin";
constexpr int kSchemaVersion = 1;
constexpr double kInfinity = 1e9;

constexpr const char* kEquation1 = "Sensors 2019, 19(18), 3896, eq. 1";
constexpr const char* kSection2 = "Sensors 2019, 19(18), 3896, section 2";
constexpr const char* kSection31 = "Sensors 2019, 19(18), 3896, section 3.1";

// clang-format off
const Entry kTable[] = {
    {"person.size", &P::person_size, 1.0, 0.5, 2, "1", "choice: hand's length beside that of placement's; a strip covers more of a smaller one, so that bends go with 1/size"},
    {"person.speed", &P::person_speed, 1.0, 0.5, 3, "1", "choice: mean speed beside the gesture's own"},
    {"person.pose_share", &P::pose_share, 1.0, 0.1, 1, "1", "choice: how far from the finger's lower limit, the straight finger, a pose goes beside the gesture's own"},
    {"person.start_spread_s", &P::start_spread_s, 0.05, 0, 1, "s", "choice: nobody starts twice at the same instant"},
    {"person.rest_s", &P::rest_s, 53.38, 0, 3600, "s", "fitted: flexor calibrate-twin; how long hand and glove keep the first pose before a recording starts"},
    {"person.pose_spread_deg", &P::pose_spread_deg, 0.3804, 0, 20, "deg", "fitted: flexor calibrate-twin; one standard deviation at either limit"},
    {"person.speed_spread", &P::speed_spread, 0.05, 0, 0.5, "1", "choice: 'approximately 83 deg/s', one standard deviation"},

    {"placement.bend_lower_deg", &P::bend_lower_deg, PerFinger{83.04, 18.63, 24.1, 20.5, 35.13}, -50, 250, "deg", "fitted: flexor calibrate-twin"},
    {"placement.bend_upper_deg", &P::bend_upper_deg, PerFinger{171.4, 126.3, 100.9, 110.9, 117.6}, -50, 250, "deg", "fitted: flexor calibrate-twin"},
    {"placement.spread_deg", &P::donning_spread_deg, 2.0, 0, 60, "deg", "choice: offset between donnings, one standard deviation"},
    {"placement.gain_spread", &P::donning_gain_spread, 0.03, 0, 0.5, "1", "choice: one standard deviation between donnings"},
    {"cloth.knuckle_deg", &P::knuckle_deg, 2.0, 0, 20, "deg", "choice: the bend of a strip over a round knuckle, largest deviation from a line"},
    {"cloth.slip_deg", &P::slip_deg, 0.8367, 0, 30, "deg", "fitted: flexor calibrate-twin"},
    {"cloth.visco_share", &P::visco_share, 0.03, 0, 1, "1", "choice: share of the bend that the cloth delays"},
    {"cloth.visco_s", &P::visco_s, 0.15, 0.001, 10, "s", "choice: cotton recovers within a few tenths of a second"},
    {"cloth.creep_share", &P::creep_share, 0.03078, 0, 1, "1", "fitted: flexor calibrate-twin; share of the bend that comes late"},
    {"cloth.creep_s", &P::creep_s, 8.0, 0.1, 1000, "s", "choice: slow beside a movement, quick beside a recording"},
    {"sensor.drift_deg_per_min", &P::drift_deg_per_min, 1.0, 0, 100, "deg/min", "choice: one standard deviation over trials"},
    {"sensor.noise_deg", &P::noise_deg, 0.5, 0, 60, "deg", "choice: a few counts of the ADC"},
    {"sensor.noise_s", &P::noise_s, 0.02, 0, 10, "s", "choice: correlation time of the coloured noise"},
    {"sensor.flutter_deg", &P::flutter_deg, 1.0, 0, 60, "deg", "choice: the strip moving in its pocket, one standard deviation"},
    {"sensor.flutter_hz", &P::flutter_hz, 4.5, 0.1, 50, "Hz", "choice: the slow end of a hand's tremor"},
    {"sensor.flutter_damping_per_s", &P::flutter_damping_per_s, 2.0, 0.01, 100, "1/s", "choice: a tremor keeps its phase for half a second"},
    {"sensor.burst_rate_per_s", &P::burst_rate_per_s, 0.02, 0, 100, "1/s", "choice: bad contacts, for each finger"},
    {"sensor.burst_deg", &P::burst_deg, 20.0, 0, 180, "deg", "choice: one standard deviation inside a burst"},
    {"sensor.burst_s", &P::burst_s, 0.2, 0.001, 10, "s", "choice: mean duration of a burst"},
    {"divider.flat_kohm", &P::flat_kohm, 25.0, 0.001, 1e6, "kohm", kEquation1},
    {"divider.kohm_per_deg", &P::kohm_per_deg, 100.0 / 180, 1e-6, 1e6, "kohm/deg", kEquation1},
    {"divider.fixed_kohm", &P::divider_kohm, 35.0, 0.001, 1e6, "kohm", kSection2},
    {"divider.reference_V", &P::reference_V, 5.0, 0.1, 50, "V", kSection2},

    {"radio.baud", &P::baud, 9600.0, 1, 1e7, "1/s", "HC-12 data sheet, default"},
    {"radio.frame_bytes", &P::frame_bytes, 12.0, 5, 255, "byte", "choice: five 9-bit angles, sequence, CRC-16 and framing"},
    {"radio.frame_rate_hz", &P::frame_rate_hz, 0.0, 0, 1000, "Hz", "choice: 0 sends each sample"},
    {"radio.module_latency_s", &P::module_latency_s, 0.002, 0, 10, "s", "choice: buffering of an HC-12 pair beside the airtime"},
    {"radio.jitter_s", &P::jitter_s, 0.002, 0, 10, "s", "choice: extra delay, uniform between 0 and this"},
    {"radio.loss", &P::loss, 0.0, 0, 1, "1", "choice: a clean bench; share of frames that never arrive"},
    {"radio.corruption", &P::corruption, 0.0, 0, 1, "1", "choice: share of frames that the CRC rejects"},
    {"radio.outage_start_s", &P::outage_start_s, 0.0, 0, kInfinity, "s", "choice: none"},
    {"radio.outage_s", &P::outage_s, 0.0, 0, kInfinity, "s", "choice: none"},

    {"hand.lower_deg", &P::hand_lower_deg, PerFinger{90, 28, 28, 28, 28}, 0, 180, "deg", kSection31},
    {"hand.upper_deg", &P::hand_upper_deg, PerFinger{170, 113, 113, 113, 113}, 0, 180, "deg", kSection31},
    {"hand.stop_stiffness_mNm_deg", &P::stop_stiffness_mNm_deg, 0.0, 0, 1000, "mNm/deg", "choice: 0, stops that do not give. What rubber takes: about 100"},
    {"hand.stop_damping_mNms_deg", &P::stop_damping_mNms_deg, 0.0, 0, 0.5, "mNm s/deg", "choice: of stops that give"},
    {"motor.supply_V", &P::motor_V, 6.0, 0.1, 100, "V", "data sheets of 10 x 12 mm gear motors, 6 V, 150:1"},
    {"motor.resistance_ohm", &P::resistance_ohm, 3.8, 0.01, 1e4, "ohm", "the same: stall current 1.6 A"},
    {"motor.torque_constant_mNm_A", &P::torque_constant_mNm_A, 1.8, 1e-3, 1e4, "mNm/A", "the same: no-load speed 200 rpm behind the gear"},
    {"motor.gear_ratio", &P::gear_ratio, 150.0, 1, 1e4, "1", "the same"},
    {"motor.gear_efficiency", &P::gear_efficiency, 0.55, 0.01, 1, "1", "the same: stall torque 235 mNm"},
    {"motor.rotor_inertia_gcm2", &P::rotor_inertia_gcm2, 0.05, 1e-4, 1e4, "g cm^2", "choice: an iron rotor of 3 g and 6 mm"},
    {"motor.finger_inertia_gcm2", &P::finger_inertia_gcm2, 400.0, 0, 1e6, "g cm^2", "choice: 30 g at 3.6 cm"},
    {"motor.current_limit_A", &P::current_limit_A, 1.2, 0.01, 100, "A", "choice: a two-channel driver of that size"},
    {"motor.coulomb_mNm", &P::coulomb_mNm, 12.0, 0, 1e4, "mNm", "choice: 5 % of the stall torque, behind the gear"},
    {"motor.viscous_mNms_rad", &P::viscous_mNms_rad, 1.0, 0, 1e4, "mNm s/rad", "choice: a tenth of what the motor's own induction brakes"},
    {"motor.backlash_deg", &P::backlash_deg, 0.2, 0, 20, "deg", "choice: half of a spur gear's play, between motor and joint"},
    {"motor.disturbance_mNm", &P::disturbance_mNm, 10.0, 0, 1e4, "mNm", "choice: bound of d_in; the article gives no size"},
    {"motor.disturbance_s", &P::disturbance_s, 1.0, 0.01, 100, "s", "choice: 'slow'"},
    {"potentiometer.range_deg", &P::potentiometer_range_deg, 250.0, 180, 255, "deg", "choice: 10-bit reading over this range"},
    {"potentiometer.noise_deg", &P::potentiometer_noise_deg, 0.15, 0, 20, "deg", "choice: half a count"},
    {"loop.proportional_per_deg", &P::loop_proportional_per_deg, 0.05, 0, 0.99, "1/deg", "choice: full duty at 20 degrees, as quick as the motor allows; the published errors leave the hand about 20 ms"},
    {"loop.integral_per_deg_s", &P::loop_integral_per_deg_s, 0.126, 0, 3.9, "1/(deg s)", "fitted: flexor calibrate-twin"},
    {"loop.integral_limit", &P::loop_integral_limit, 114.2, 0, 120, "1", "fitted: flexor calibrate-twin; in full duties. The article names no anti-windup"},
    {"loop.lower_deg", &P::loop_lower_deg, 0.0, 0, 180, "deg", "choice: the article limits the joint (eq. 6), not the command"},
    {"loop.upper_deg", &P::loop_upper_deg, 180.0, 0, 180, "deg", "choice: the article limits the joint (eq. 6), not the command"},
    {"loop.speed_deg_s", &P::loop_speed_deg_s, 800.0, 1, 100000, "deg/s", "choice: ten times the speed of the gestures"},
    {"loop.duty", &P::loop_duty, 1.0, 0.01, 1, "1", "choice: the whole supply"},
    {"loop.feed_forward_s_per_deg", &P::loop_feed_forward_s_per_deg, 0.0, 0, 0.00099, "s/deg", "choice: none; the article names a PI controller"},

    {"camera.rate_hz", &P::camera_rate_hz, 30.0, 1, 1000, "Hz", "choice: an ordinary USB camera"},
    {"camera.glove_latency_s", &P::glove_camera_latency_s, 0.04, 0, 1, "s", "choice: both cameras alike, so that it cancels"},
    {"camera.hand_latency_s", &P::hand_camera_latency_s, 0.04, 0, 1, "s", "choice: both cameras alike, so that it cancels"},
    {"camera.noise_deg", &P::camera_noise_deg, 0.05, 0, 20, "deg", "choice: as for person.pose_spread_deg; one standard deviation"},
};
// clang-format on

double& field(Parameters& p, const Entry& entry, int finger) {
  if (const auto* scalar = std::get_if<double P::*>(&entry.member)) return p.*(*scalar);
  return (p.*std::get<PerFinger P::*>(entry.member))[static_cast<std::size_t>(finger)];
}

double field(const Parameters& p, const Entry& entry, int finger) {
  return field(const_cast<Parameters&>(p), entry, finger);
}

bool is_per_finger(const Entry& entry) { return std::holds_alternative<PerFinger P::*>(entry.member); }

const char* const kFaultNames[] = {"open", "short", "stuck", "loose"};

FaultKind fault_kind(const std::string& name) {
  for (int i = 0; i < 4; ++i) {
    if (name == kFaultNames[i]) return static_cast<FaultKind>(i);
  }
  throw InputError(fmt::format("unknown fault \"{}\"; known: {}", name, fmt::join(kFaultNames, ", ")));
}

const Entry* find(const std::string& name) {
  const auto it = std::ranges::find_if(kTable, [&](const Entry& e) { return e.name == name; });
  return it == std::end(kTable) ? nullptr : it;
}

[[noreturn]] void unknown(const std::string& name) {
  std::vector<std::string> near;
  const std::string section = name.substr(0, name.find('.') + 1);
  for (const Entry& e : kTable) {
    if (section.empty() || std::string(e.name).starts_with(section)) near.emplace_back(e.name);
  }
  if (near.empty()) {
    for (const Entry& e : kTable) near.emplace_back(e.name);
  }
  throw InputError(fmt::format("unknown twin parameter \"{}\"; known: {}", name, fmt::join(near, ", ")));
}

// "radio.loss", or one finger's: "placement.bend_lower_deg.index".
std::pair<const Entry*, std::optional<int>> place(const std::string& name) {
  if (const Entry* entry = find(name)) return {entry, std::nullopt};
  const auto dot = name.rfind('.');
  const Entry* entry = dot == std::string::npos ? nullptr : find(name.substr(0, dot));
  if (entry == nullptr || !is_per_finger(*entry)) unknown(name);
  return {entry, finger_index(name.substr(dot + 1))};
}

void read_value(const Json& value, const Entry& entry, Parameters& p) {
  const auto fail = [&] {
    throw InputError(fmt::format("\"value\" must be a number{}",
                                 is_per_finger(entry) ? " or an object with one for each finger" : ""));
  };
  if (value.is_number()) {
    for (int i = 0; i < kFingers; ++i) field(p, entry, i) = value.get<double>();
    return;
  }
  if (!is_per_finger(entry) || !value.is_object()) fail();
  std::array<bool, kFingers> given{};
  for (const auto& item : value.items()) {
    if (!item.value().is_number()) fail();
    const int finger = finger_index(item.key());
    const auto i = static_cast<std::size_t>(finger);
    if (given[i]) {
      throw InputError(fmt::format("\"value\" gives {} twice; remove one", model::finger_names()[i]));
    }
    given[i] = true;
    field(p, entry, finger) = item.value().get<double>();
  }
}

Fault read_fault(const Json& json, const std::string& place) {
  io::JsonReader reader(json, place);
  Fault fault;
  fault.finger = finger_index(reader.text("finger"));
  fault.kind = fault_kind(reader.text("kind"));
  fault.start_s = reader.number_within("start_s", 0, kInfinity);
  fault.duration_s = reader.number_within("duration_s", 0, kInfinity);
  reader.done();
  return fault;
}

void require(bool good, const std::string& rule) {
  if (!good) throw InputError(rule);
}

}  // namespace

int finger_index(const std::string& name) {
  const auto& names = model::finger_names();
  return static_cast<int>(std::ranges::find(names, model::finger(name)) - names.begin());
}

Parameters::Parameters() {
  for (const Entry& e : kTable) {
    if (const auto* scalar = std::get_if<double P::*>(&e.member)) {
      this->*(*scalar) = std::get<double>(e.value);
    } else {
      this->*std::get<PerFinger P::*>(e.member) = std::get<PerFinger>(e.value);
    }
  }
}

std::span<const Entry> table() { return kTable; }

std::string value_text(const Parameters& p, const Entry& entry) {
  std::string out = fmt::format("{}", field(p, entry, 0));
  for (int i = 1; i < (is_per_finger(entry) ? kFingers : 1); ++i)
    out += fmt::format(" {}", field(p, entry, i));
  return out;
}

void check(const Parameters& p) {
  for (const Entry& e : kTable) {
    for (int i = 0; i < (is_per_finger(e) ? kFingers : 1); ++i) {
      const double value = field(p, e, i);
      require(value >= e.min && value <= e.max,
              fmt::format("{}: {} {} is impossible; it must lie between {} and {}", e.name, value, e.unit,
                          e.min, e.max));
    }
  }
  for (std::size_t i = 0; i < kFingers; ++i) {
    require(p.hand_lower_deg[i] < p.hand_upper_deg[i],
            fmt::format("hand.lower_deg of {}, {:g}, must be below hand.upper_deg, {:g}",
                        model::finger_names()[i], p.hand_lower_deg[i], p.hand_upper_deg[i]));
    require(p.bend_lower_deg[i] < p.bend_upper_deg[i],
            fmt::format("placement.bend_lower_deg of {}, {:g}, must be below placement.bend_upper_deg, {:g}",
                        model::finger_names()[i], p.bend_lower_deg[i], p.bend_upper_deg[i]));
  }
  require(p.loop_lower_deg < p.loop_upper_deg,
          fmt::format("loop.lower_deg, {:g}, must be below loop.upper_deg, {:g}", p.loop_lower_deg,
                      p.loop_upper_deg));
  // The motor's speed must settle over several steps, else the step itself is unstable.
  const double inertia_mNms2 =
      (p.rotor_inertia_gcm2 * p.gear_ratio * p.gear_ratio + p.finger_inertia_gcm2) * 1e-4;
  const double damping_mNms = p.torque_constant_mNm_A * p.gear_ratio * p.gear_efficiency *
                              p.torque_constant_mNm_A / 1000 * p.gear_ratio / p.resistance_ohm;
  require(
      damping_mNms * kStep_s < inertia_mNms2,
      fmt::format(
          "motor.*: its time constant, {:.2g} s, is faster than the plant's step of {} s: more inertia or "
          "resistance, or a smaller torque constant",
          inertia_mNms2 / damping_mNms, kStep_s));
  const double airtime_s = p.frame_bytes * 10 / p.baud;
  require(
      p.frame_rate_hz * airtime_s <= 1,
      fmt::format("radio.frame_rate_hz: {} frames of {} bytes a second do not fit {} baud; at most {:.0f}",
                  p.frame_rate_hz, p.frame_bytes, p.baud, 1 / airtime_s));
  for (const Fault& f : p.faults) {
    require(f.start_s >= 0 && f.duration_s >= 0, "faults: start_s and duration_s must not be negative");
  }
}

Parameters from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  if (!reader.has("schema") || reader.text("schema") != kSchema) {
    reader.fail(fmt::format("not a twin's configuration: \"schema\" must be \"{}\"", kSchema));
  }
  if (reader.number("schema_version") != kSchemaVersion) {
    reader.fail(fmt::format("has another schema version than {}; update Flexor", kSchemaVersion));
  }
  Parameters p;
  try {
    const Json parameters = reader.object_or_empty("parameters");
    for (const auto& item : parameters.items()) {
      const Entry* entry = find(item.key());
      if (entry == nullptr) unknown(item.key());
      io::JsonReader one(item.value(), item.key());
      try {
        read_value(one.member("value"), *entry, p);
      } catch (const InputError& error) {
        one.fail(error.what());
      }
      (void)one.text_or_empty("unit");
      if (one.has("unit") && one.text("unit") != entry->unit) {
        one.fail(fmt::format("the unit is {}, not {}", entry->unit, one.text("unit")));
      }
      (void)one.text_or_empty("source");
      one.done();
    }
    if (reader.has("faults")) {
      const Json& faults = reader.member("faults");
      if (!faults.is_array()) reader.fail("\"faults\" must be a list");
      for (const Json& fault : faults) p.faults.push_back(read_fault(fault, "faults"));
    }
    reader.done();
    check(p);
  } catch (const InputError& error) {
    const std::string what = error.what();
    throw InputError(what.starts_with(source + ": ") ? what : fmt::format("{}: {}", source, what));
  }
  return p;
}

Parameters load(const std::filesystem::path& path) {
  return from_json(io::read_document(path), path.string());
}

std::string to_json(const Parameters& p) {
  Json parameters = Json::object();
  for (const Entry& e : kTable) {
    Json value;
    if (is_per_finger(e)) {
      for (int i = 0; i < kFingers; ++i)
        value[model::finger_names()[static_cast<std::size_t>(i)]] = field(p, e, i);
    } else {
      value = field(p, e, 0);
    }
    parameters[e.name] = {{"value", std::move(value)}, {"unit", e.unit}, {"source", e.source}};
  }
  Json faults = Json::array();
  for (const Fault& f : p.faults) {
    faults.push_back({{"finger", model::finger_names()[static_cast<std::size_t>(f.finger)]},
                      {"kind", kFaultNames[static_cast<int>(f.kind)]},
                      {"start_s", f.start_s},
                      {"duration_s", f.duration_s}});
  }
  const Json json = {{"schema", kSchema},
                     {"schema_version", kSchemaVersion},
                     {"parameters", std::move(parameters)},
                     {"faults", std::move(faults)}};
  return io::dump(json);
}

void assign(Parameters& p, const std::string& assignment) {
  const auto equals = assignment.find('=');
  require(equals != std::string::npos, fmt::format("\"{}\": write name=value", assignment));
  const std::string name = assignment.substr(0, equals);
  const std::string text = assignment.substr(equals + 1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  require(error == std::errc() && end == text.data() + text.size(),
          fmt::format("{}: \"{}\" is not a number", name, text));
  const auto [entry, finger] = place(name);
  if (finger) {
    field(p, *entry, *finger) = value;
    return;
  }
  for (int i = 0; i < kFingers; ++i) field(p, *entry, i) = value;
}

double value(const Parameters& p, const std::string& name) {
  const auto [entry, finger] = place(name);
  return field(p, *entry, finger.value_or(0));
}

}  // namespace flexor::twin
