// What surrounds the electronics in one trial: how the person varies, the sensors in their cloth, what pushes
// the motors.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/twin/glove.hpp"
#include "host/twin/motion.hpp"
#include "host/twin/parameters.hpp"
#include "host/twin/random.hpp"

namespace flexor::twin {

inline constexpr std::int64_t kWarmUp_ms = 500;  // simulate() begins so long before t = 0
inline constexpr int kBlock_ms = 10;  // reference, disturbance and drift are straight lines in between
inline constexpr double kBlock_s = kBlock_ms * kStep_s;

// What random draws are for; part of every seed.
enum class Purpose : std::uint64_t { person = 1, sensor, radio, disturbance, potentiometer, camera, phase };

// When a camera takes its frame, ms; it sees what was there a latency ago.
std::int64_t frame_ms(std::size_t frame, double rate_hz, double latency_s);

Variation draw_variation(const Parameters& parameters, std::uint64_t trial_seed);

// One sensor on one finger of one trial: everything that happens to the bend before the ADC sees it.
class Sensor {
 public:
  Sensor() = default;
  Sensor(const Parameters& parameters, int finger, double period_s, std::uint64_t seed);

  // ADC counts at time t_s for the cloth's bend; one call a sample.
  int sample(const Divider& divider, double t_s, double bend_deg);

  // On the finger, degrees of bend beside what the donning drew; until the next call.
  void shift(double bend_deg) { shift_deg_ = bend_deg; }

  // It has drifted for so long when t_s is 0, the other way after every `turns_s`; 0: always the same way.
  void wear(double seconds, double turns_s) {
    worn_s_ = seconds;
    turns_s_ = turns_s;
  }

 private:
  double drifted_s(double t_s) const;

  const Parameters* p_ = nullptr;
  Random random_;
  double lower_deg_ = 0;
  double range_deg_ = 1;
  double offset_deg_ = 0;
  double shift_deg_ = 0;
  double gain_ = 1;
  double drift_deg_s_ = 0;
  double worn_s_ = 0;
  double turns_s_ = 0;
  double noise_keep_ = 0;
  double noise_ = 0;
  double flutter_cos_ = 0;
  double flutter_sin_ = 0;
  double flutter_new_ = 0;
  std::array<double, 2> flutter_{};
  double burst_begin_ = 0;
  double burst_end_ = 0;
  bool in_burst_ = false;
  int last_ = kAdcTop / 2;
  std::vector<const Fault*> faults_;
};

// d_in: a slow random walk that is pulled back to zero and never leaves its bound.
class Disturbance {
 public:
  Disturbance() = default;
  Disturbance(const Parameters& parameters, std::uint64_t seed);

  // mNm over the next block.
  double next();

 private:
  Random random_;
  double keep_ = 0;
  double new_ = 0;
  double bound_ = 0;
  double value_ = 0;
};

}  // namespace flexor::twin
