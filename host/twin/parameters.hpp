// Everything about the simulated laboratory that is a number, with its unit, its default and its source.
//
// A configuration file is JSON, as `flexor twin --json` prints it:
//   {"schema": "flexor-twin", "schema_version": 1,
//    "parameters": {NAME: {"value", "unit", "source"}, ...},
//    "faults": [{"finger", "kind": "open" | "short" | "stuck" | "loose", "start_s", "duration_s"}, ...]}
// Values are numbers, for some also one number for each finger. A name that is left out keeps its default; an
// unknown one is an error. Faults start and last at most 1e9 s. table() is the list, and the only one.
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace flexor::twin {

inline constexpr double kStep_s = 0.001;  // the plant's
inline constexpr int kFingers = 5;        // thumb index middle ring pinky: motors of the published hand
using PerFinger = std::array<double, kFingers>;

// 0 for thumb to 4 for pinky; aliases as in host/model. Throws io::InputError, listing the names.
int finger_index(const std::string& name);

enum class FaultKind { open, short_circuit, stuck, loose };

// A sensor that fails between start_s and start_s + duration_s of every trial.
struct Fault {
  int finger = 0;
  FaultKind kind = FaultKind::open;
  double start_s = 0;
  double duration_s = 0;
};

struct Parameters {
  // person, beside the one whom the gestures describe and the glove was fitted to
  double person_size = 0;
  double person_speed = 0;
  double pose_share = 0;
  // how one trial differs from the next
  double start_spread_s = 0;
  double rest_s = 0;
  double pose_spread_deg = 0;
  double speed_spread = 0;

  // sensor in its cloth
  PerFinger bend_lower_deg{};
  PerFinger bend_upper_deg{};
  double donning_spread_deg = 0;
  double donning_gain_spread = 0;
  double knuckle_deg = 0;
  double slip_deg = 0;
  double visco_share = 0;
  double visco_s = 0;
  double creep_share = 0;
  double creep_s = 0;
  double drift_deg_per_min = 0;
  double noise_deg = 0;
  double noise_s = 0;
  double flutter_deg = 0;
  double flutter_hz = 0;
  double flutter_damping_per_s = 0;
  double burst_rate_per_s = 0;
  double burst_deg = 0;
  double burst_s = 0;

  // divider and ADC
  double flat_kohm = 0;
  double kohm_per_deg = 0;
  double divider_kohm = 0;
  double reference_V = 0;

  // radio
  double baud = 0;
  double frame_bytes = 0;
  double frame_rate_hz = 0;
  double module_latency_s = 0;
  double jitter_s = 0;
  double loss = 0;
  double corruption = 0;
  double outage_start_s = 0;
  double outage_s = 0;

  // hand
  PerFinger hand_lower_deg{};
  PerFinger hand_upper_deg{};
  double stop_stiffness_mNm_deg = 0;
  double stop_damping_mNms_deg = 0;
  double motor_V = 0;
  double resistance_ohm = 0;
  double torque_constant_mNm_A = 0;
  double gear_ratio = 0;
  double gear_efficiency = 0;
  double rotor_inertia_gcm2 = 0;
  double finger_inertia_gcm2 = 0;
  double current_limit_A = 0;
  double coulomb_mNm = 0;
  double viscous_mNms_rad = 0;
  double backlash_deg = 0;
  double disturbance_mNm = 0;
  double disturbance_s = 0;
  double potentiometer_range_deg = 0;
  double potentiometer_noise_deg = 0;
  double loop_proportional_per_deg = 0;
  double loop_integral_per_deg_s = 0;
  double loop_integral_limit = 0;
  double loop_speed_deg_s = 0;
  double loop_lower_deg = 0;
  double loop_upper_deg = 0;
  double loop_duty = 0;
  double loop_feed_forward_s_per_deg = 0;

  // cameras
  double camera_rate_hz = 0;
  double glove_camera_latency_s = 0;
  double hand_camera_latency_s = 0;
  double camera_noise_deg = 0;

  std::vector<Fault> faults;

  // Every entry's default.
  Parameters();
};

struct Entry {
  const char* name;
  std::variant<double Parameters::*, PerFinger Parameters::*> member;
  std::variant<double, PerFinger> value;  // the default
  double min;                             // an InputError outside [min, max]
  double max;
  const char* unit;
  const char* source;
};

std::span<const Entry> table();

// "0.2", or one number for each finger: "1 2 3 4 5".
std::string value_text(const Parameters& parameters, const Entry& entry);

// Throws io::InputError naming the parameter and its range, or the rule that two of them break.
void check(const Parameters& parameters);

Parameters load(const std::filesystem::path& path);
Parameters from_json(const std::string& text, const std::string& source);
std::string to_json(const Parameters& parameters);

// "radio.loss=0.05", "placement.bend_lower_deg.index=40". Throws io::InputError, listing near names.
void assign(Parameters& parameters, const std::string& assignment);

// What assign() sets by that name; of a name for every finger, the thumb's.
double value(const Parameters& parameters, const std::string& name);

}  // namespace flexor::twin
