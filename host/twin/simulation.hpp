// Whole trials: person, glove, compensator, radio, hand and cameras in a closed chain.
//
// Every trial starts half a second early, at rest in its first pose, so that the hand is settled at t = 0;
// only what the cameras see from 0 on counts. Random draws depend on (seed, trial) and on what is drawn, not
// on the compensator: two compensators meet the same trials.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/model/host_chain.hpp"
#include "host/model/model.hpp"
#include "host/model/tracking.hpp"
#include "host/twin/motion.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::twin {

inline constexpr int kTrialsAtOnce = 16;  // lanes of the vector code are these times the fingers
inline constexpr double kMaxRate_hz = 1000;
inline constexpr int kMaxPictures = 120000;  // of each camera in a trial: an hour at 33 a second

// The glove follows each sensor while it is worn (runtime/sensor/tracker.hpp); sensors without a range are left alone.
struct Tracking {
  std::array<std::optional<model::TrackedRange>, kFingers> sensor;
};

// What the glove was worn for: a motion, again and again.
struct Worn {
  Motion motion;
  double duration_s = 0;
  double drift_turns_s = 0;  // sensors drift the other way every so often; 0: always the same way
};

struct TrialInput {
  Parameters parameters;
  Motion motion;
  model::Model compensator;  // five channels by name, sampled at its own period
  std::uint64_t seed = 1;
  bool record_samples = false;
  std::optional<Worn> worn = {};  // before the trial
  std::optional<Tracking> tracking = {};
};

struct Trial {
  // Frame k is taken at k / camera rate; one vector for each finger. What a camera measures, noise and all.
  std::array<std::vector<float>, kFingers> glove_deg;
  std::array<std::vector<float>, kFingers> hand_deg;
  PerFinger error_deg_s{};              // integral |rho_r - rho| at 1 kHz, without cameras
  std::array<int, kFingers> impacts{};  // how often the joint came to either of its end stops
  PerFinger impact_deg_s{};             // fastest arrival of the joint at either of its end stops; 0: none
  PerFinger pressed_s{};                // how long its motor pressed against a stop; see plant.hpp
  int frames_sent = 0;
  int frames_lost = 0;  // lost, corrupt, in an outage, or overtaken
  // With record_samples: what the glove read and sent, sample k at sample_s[k].
  std::vector<double> sample_s;
  std::array<std::vector<double>, kFingers>
      reading;  // in the unit of the sensor's input, alpha where it feeds none; before it is tracked
  std::array<std::vector<double>, kFingers> beta_deg;
  std::array<std::vector<double>, kFingers> true_deg;
  bool operator==(const Trial&) const = default;
};

// Throws io::InputError: a compensator without a channel for each finger, a rate above the plant's, a frame
// rate that the radio cannot carry.
void check(const TrialInput& input);

// The glove's chain of a trial, as the board has it. Throws io::InputError: as check().
model::ChainParts glove_chain(const TrialInput& input);

// Trials first .. first + count - 1, count at most kTrialsAtOnce. Reads `input` only: call it from any
// thread.
std::vector<Trial> simulate(const TrialInput& input, std::uint64_t first, int count);

// The same, trial by trial and finger by finger: equal to the bit, and the yardstick for speed.
std::vector<Trial> simulate_scalar(const TrialInput& input, std::uint64_t first, int count);

// What the glove reads of each finger while it is worn before that trial, degrees, at the compensator's rate.
std::array<std::vector<double>, kFingers> worn_readings(const TrialInput& input, std::uint64_t trial);

// Joints of a finger in degrees when its MCP is at mcp_deg; eqs. 4 and 5 of the article.
struct Posture {
  double mcp_deg;
  double pip_deg;  // the thumb's interphalangeal joint
  double dip_deg;  // the thumb has none: 0
};
Posture posture(int finger, double mcp_deg);

}  // namespace flexor::twin
