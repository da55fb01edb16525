#include "host/twin/parameters.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/model/model.hpp"

namespace flexor::twin {
namespace {

using io::InputError;

constexpr const char* kSchema = "flexor-twin";
constexpr int kSchemaVersion = 2;
constexpr double kInfinity = 1e9;

// clang-format off
model::Numbers own_numbers(Parameters& p) {
  return {
      {"person.size", p.person_size, 0.5, 2, "1", "choice: hand's length beside that of placement's; a sensor covers more of a smaller one, so that bends go with 1/size"},
      {"person.speed", p.person_speed, 0.5, 3, "1", "choice: mean speed beside the gesture's own"},
      {"person.pose_share", p.pose_share, 0.1, 1, "1", "choice: how far from the finger's lower limit, the straight finger, a pose goes beside the gesture's own"},
      {"person.start_spread_s", p.start_spread_s, 0, 1, "s", "choice: nobody starts twice at the same instant"},
      {"person.rest_s", p.rest_s, 0, 3600, "s", "fitted: docs/adr/0005; how long hand and glove keep the first pose before a recording starts"},
      {"person.pose_spread_deg", p.pose_spread_deg, 0, 20, "deg", "fitted: docs/adr/0005; one standard deviation at either limit"},
      {"person.speed_spread", p.speed_spread, 0, 0.5, "1", "choice: 'approximately 83 deg/s', one standard deviation"},
      {"placement.bend_lower_deg", p.bend_lower_deg, -50, 250, "deg", "fitted: docs/adr/0005"},
      {"placement.bend_upper_deg", p.bend_upper_deg, -50, 250, "deg", "fitted: docs/adr/0005"},
      {"placement.spread_deg", p.donning_spread_deg, 0, 60, "deg", "choice: offset between donnings, one standard deviation"},
      {"placement.gain_spread", p.donning_gain_spread, 0, 0.5, "1", "choice: one standard deviation between donnings"},
      {"cloth.knuckle_deg", p.knuckle_deg, 0, 20, "deg", "fitted: docs/adr/0005; the bend of a sensor over a round knuckle, largest deviation from a line; real joints 2.5 to 4.4"},
      {"cloth.slip_deg", p.slip_deg, 0, 30, "deg", "fitted: docs/adr/0005"},
      {"cloth.visco_share", p.visco_share, 0, 1, "1", "choice: share of the bend that the cloth delays"},
      {"cloth.visco_s", p.visco_s, 0.001, 10, "s", "choice: cotton recovers within a few tenths of a second"},
      {"cloth.creep_share", p.creep_share, 0, 1, "1", "fitted: docs/adr/0005; share of the bend that comes late"},
      {"cloth.creep_s", p.creep_s, 0.1, 1000, "s", "choice: slow beside a movement, quick beside a recording"},
      {"cloth.neighbour_share", p.neighbour_share, 0, 0.5, "1", "fitted: docs/adr/0005; share of a neighbour's bend, both of their range, that a sensor feels through the cloth"},
      {"cloth.thumb_share", p.thumb_share, 0, 0.5, "1", "fitted: docs/adr/0005; the same between thumb and index"},
      {"sensor.drift_deg_per_min", p.drift_deg_per_min, 0, 100, "deg/min", "fitted: docs/adr/0005; one standard deviation over trials; real joints 0.2 to 1.3"},
      {"sensor.noise_deg", p.noise_deg, 0, 60, "deg", "fitted: docs/adr/0005; real sensors 0.26 to 0.40"},
      {"sensor.noise_s", p.noise_s, 0, 10, "s", "choice: correlation time of the coloured noise"},
      {"sensor.flutter_deg", p.flutter_deg, 0, 60, "deg", "fitted: docs/adr/0005; the sensor moving in its pocket, one standard deviation; real sensors 0.18 to 0.31"},
      {"sensor.flutter_hz", p.flutter_hz, 0.1, 50, "Hz", "choice: the slow end of a hand's tremor"},
      {"sensor.flutter_damping_per_s", p.flutter_damping_per_s, 0.01, 100, "1/s", "choice: a tremor keeps its phase for half a second"},
      {"sensor.burst_rate_per_s", p.burst_rate_per_s, 0, 100, "1/s", "choice: bad contacts, for each finger"},
      {"sensor.burst_deg", p.burst_deg, 0, 180, "deg", "choice: one standard deviation inside a burst"},
      {"sensor.burst_s", p.burst_s, 0.001, 10, "s", "choice: mean duration of a burst"},
      {"radio.frame_bytes", p.frame_bytes, 5, 255, "byte", "choice: five 9-bit angles, sequence, CRC-16 and framing"},
      {"radio.module_latency_s", p.module_latency_s, 0, 10, "s", "choice: buffering of an HC-12 pair beside the airtime"},
      {"radio.jitter_s", p.jitter_s, 0, 10, "s", "choice: extra delay, uniform between 0 and this"},
      {"radio.loss", p.loss, 0, 1, "1", "choice: a clean bench; share of frames that never arrive"},
      {"radio.corruption", p.corruption, 0, 1, "1", "choice: share of frames that the CRC rejects"},
      {"radio.outage_start_s", p.outage_start_s, 0, kInfinity, "s", "choice: none"},
      {"radio.outage_s", p.outage_s, 0, kInfinity, "s", "choice: none"},
      {"hand.stop_stiffness_mNm_deg", p.stop_stiffness_mNm_deg, 0, 1000, "mNm/deg", "choice: 0, stops that do not give. What rubber takes: about 100"},
      {"hand.stop_damping_mNms_deg", p.stop_damping_mNms_deg, 0, 0.5, "mNm s/deg", "choice: of stops that give"},
      {"motor.backlash_deg", p.backlash_deg, 0, 20, "deg", "choice: half of a spur gear's play, between motor and joint"},
      {"motor.disturbance_s", p.disturbance_s, 0.01, 100, "s", "choice: 'slow'"},
      {"potentiometer.noise_deg", p.potentiometer_noise_deg, 0, 20, "deg", "choice: half a count"},
      {"camera.rate_hz", p.camera_rate_hz, 1, 1000, "Hz", "choice: an ordinary USB camera"},
      {"camera.glove_latency_s", p.glove_camera_latency_s, 0, 1, "s", "choice: both cameras alike, so that it cancels"},
      {"camera.hand_latency_s", p.hand_camera_latency_s, 0, 1, "s", "choice: both cameras alike, so that it cancels"},
      {"camera.noise_deg", p.camera_noise_deg, 0, 20, "deg", "choice: as for person.pose_spread_deg; one standard deviation"},
  };
}
// clang-format on

const char* const kFaultNames[] = {"open", "short", "stuck", "loose"};

Fault read_fault(const Json& json, const std::string& place) {
  io::JsonReader reader(json, place);
  Fault fault;
  fault.finger = static_cast<int>(model::finger_index(reader.text("finger")));
  const std::string kind = reader.text("kind");
  const auto* const known = std::ranges::find(kFaultNames, kind);
  if (known == std::end(kFaultNames))
    throw InputError("unknown fault \"{}\"; known: {}", kind, fmt::join(kFaultNames, ", "));
  fault.kind = static_cast<FaultKind>(known - kFaultNames);
  fault.start_s = reader.number_within("start_s", 0, kInfinity);
  fault.duration_s = reader.number_within("duration_s", 0, kInfinity);
  reader.done();
  return fault;
}

void require(bool good, const std::string& rule) {
  if (!good) throw InputError(rule);
}

}  // namespace

model::Numbers numbers(Parameters& p) {
  model::Numbers out = model::numbers(p);
  const model::Numbers own = own_numbers(p);
  out.insert(out.end(), own.begin(), own.end());
  return out;
}

model::Numbers numbers(const Parameters& p) { return numbers(const_cast<Parameters&>(p)); }

void check(const Parameters& p) {
  model::check(static_cast<const model::Hardware&>(p));
  model::check(numbers(p));
  for (std::size_t i = 0; i < kFingers; ++i)
    require(p.bend_lower_deg[i] < p.bend_upper_deg[i],
            fmt::format("placement.bend_lower_deg of {}, {:g}, must be below placement.bend_upper_deg, {:g}",
                        model::finger_names()[i], p.bend_lower_deg[i], p.bend_upper_deg[i]));
  // The motor's speed must settle over several steps, else the step itself is unstable.
  const double inertia_mNms2 = p.inertia_mNms2();
  const double damping_mNms = p.torque_mNm_A() * p.back_emf_Vs() / p.resistance_ohm;
  require(damping_mNms * kStep_s < inertia_mNms2,
          fmt::format("motor.*: its time constant, {:.2g} s, is faster than the plant's step of {} s: more "
                      "inertia or resistance, or a smaller torque constant",
                      inertia_mNms2 / damping_mNms, kStep_s));
  const double airtime_s = p.frame_bytes * 10 / p.baud;
  require(
      p.frame_rate_hz * airtime_s <= 1,
      fmt::format("radio.frame_rate_hz: {} frames of {} bytes a second do not fit {} baud; at most {:.0f}",
                  p.frame_rate_hz, p.frame_bytes, p.baud, 1 / airtime_s));
}

Parameters from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema(kSchema, kSchemaVersion);
  Parameters p;
  try {
    if (reader.has("hardware")) {
      const Json& hardware = reader.member("hardware");
      static_cast<model::Hardware&>(p) = hardware.is_string() ? model::preset(hardware.get<std::string>())
                                                              : model::hardware_of(hardware, "hardware");
    }
    model::read(reader.object_or_empty("parameters"), numbers(p));
    if (reader.has("faults")) {
      const Json& faults = reader.member("faults");
      if (!faults.is_array()) reader.fail("\"faults\" must be a list");
      for (const Json& fault : faults) p.faults.push_back(read_fault(fault, "faults"));
    }
    p.source = source;
    reader.done();
    check(p);
  } catch (const InputError& error) {
    io::fail_within(source, error);
  }
  return p;
}

Parameters load(const std::filesystem::path& path) {
  return from_json(io::read_document(path), path.string());
}

std::string to_json(const Parameters& p) {
  Json faults = Json::array();
  for (const Fault& f : p.faults)
    faults.push_back({{"finger", model::finger_names()[static_cast<std::size_t>(f.finger)]},
                      {"kind", kFaultNames[static_cast<int>(f.kind)]},
                      {"start_s", f.start_s},
                      {"duration_s", f.duration_s}});
  const Json json = {{"schema", kSchema},
                     {"schema_version", kSchemaVersion},
                     {"hardware", model::to_json(static_cast<const model::Hardware&>(p))},
                     {"parameters", model::to_json(own_numbers(const_cast<Parameters&>(p)))},
                     {"faults", std::move(faults)}};
  return io::dump(json);
}

void assign(Parameters& p, const std::string& assignment) { model::assign(numbers(p), assignment); }

}  // namespace flexor::twin
