// Everything about the simulated laboratory that is a number, with its unit, its default and its source: the hardware that is
// simulated, its person, cloth, radio's air and cameras.
//
// A configuration file is JSON, as `flexor twin --json` prints it:
//   {"schema": "flexor-twin", "schema_version": 2,
//    "hardware": a preset's name, or a document of host/model/hardware.hpp,
//    "parameters": {NAME: {"value", "unit", "source"}, ...},
//    "faults": [{"finger", "kind": "open" | "short" | "stuck" | "loose", "start_s", "duration_s"}, ...]}
// A name that is left out keeps its default; an unknown one is an error. One of the hardware changes what "hardware" gives, as in
// documents of version 1, which have no "hardware". Faults start and last at most 1e9 s. numbers() is the list, and the only one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/model/hardware.hpp"

namespace flexor::twin {

inline constexpr double kStep_s = 0.001;  // the plant's
inline constexpr int kFingers = 5;        // thumb index middle ring pinky: motors of the published hand
using model::PerFinger;

enum class FaultKind { open, short_circuit, stuck, loose };

// A sensor that fails between start_s and start_s + duration_s of every trial.
struct Fault {
  int finger = 0;
  FaultKind kind = FaultKind::open;
  double start_s = 0;
  double duration_s = 0;
};

struct Parameters : model::Hardware {
  // person, beside the one whom the gestures describe and the glove was fitted to
  double person_size = 1.0;
  double person_speed = 1.0;
  double pose_share = 1.0;
  // how one trial differs from the next
  double start_spread_s = 0.05;
  double rest_s = 49.42;
  double pose_spread_deg = 0.3806;
  double speed_spread = 0.05;

  // sensor in its cloth
  PerFinger bend_lower_deg{82.21, 19.94, 21.65, 18.94, 33.97};
  PerFinger bend_upper_deg{164, 117.3, 95.52, 108.6, 113.7};
  double donning_spread_deg = 2.0;
  double donning_gain_spread = 0.03;
  double knuckle_deg = 3.07;
  double slip_deg = 0.8707;
  double visco_share = 0.03;
  double visco_s = 0.15;
  double creep_share = 0.03071;
  double creep_s = 8.0;
  double neighbour_share = 0.05191;
  double thumb_share = 0.1123;
  double drift_deg_per_min = 0.7059;
  double noise_deg = 0.3221;
  double noise_s = 0.02;
  double flutter_deg = 0.2201;
  double flutter_hz = 4.5;
  double flutter_damping_per_s = 2.0;
  double burst_rate_per_s = 0.02;
  double burst_deg = 20.0;
  double burst_s = 0.2;

  // radio, beside the hardware's
  double frame_bytes = 12.0;
  double module_latency_s = 0.002;
  double jitter_s = 0.002;
  double loss = 0.0;
  double corruption = 0.0;
  double outage_start_s = 0.0;
  double outage_s = 0.0;

  // hand, beside the hardware's
  double stop_stiffness_mNm_deg = 0.0;
  double stop_damping_mNms_deg = 0.0;
  double backlash_deg = 0.2;
  double disturbance_s = 1.0;
  double potentiometer_noise_deg = 0.15;

  // cameras
  double camera_rate_hz = 30.0;
  double glove_camera_latency_s = 0.04;
  double hand_camera_latency_s = 0.04;
  double camera_noise_deg = 0.05;

  std::vector<Fault> faults;
};

// The hardware's, then the twin's own. Those of const parameters are to be read alone.
model::Numbers numbers(Parameters& parameters);
model::Numbers numbers(const Parameters& parameters);

// Throws io::InputError naming the parameter and its range, or the rule that two of them break.
void check(const Parameters& parameters);

Parameters load(const std::filesystem::path& path);
Parameters from_json(const std::string& text, const std::string& source);
std::string to_json(const Parameters& parameters);

// model::assign of any of its numbers.
void assign(Parameters& parameters, const std::string& assignment);

}  // namespace flexor::twin
