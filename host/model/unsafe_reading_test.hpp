// For tests: readings that a model could fail at.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "host/model/compensator.hpp"

namespace flexor::model {

// Adversarial readings of one input after the other, the others at rest: the first that takes an angle outside of its limits or, where all
// are valid, is not answered. A document may have hundreds of inputs: a few are enough.
template <class Arithmetic>
std::optional<double> unsafe_reading(const Model& m) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr bool kRefuses =
      std::is_same_v<Arithmetic, FixedArithmetic>;  // readings between its steps at the ends
  Compensator<Arithmetic> compensator(m);
  std::vector<double> u;
  for (const Input& input : m.inputs) u.push_back(input.valid_min);
  for (std::size_t i = 0; i < std::min<std::size_t>(m.inputs.size(), 8); ++i) {
    const double low = m.inputs[i].valid_min;
    const double high = m.inputs[i].valid_max;
    std::vector<double> readings = {low,  kNan, high, kInfinity, low,    -kInfinity, 1e308, -1e308,
                                    high, 0.0,  -0.0, 1e-308,    1023.0, 512.0,      -1e9,  1e9};
    constexpr int kRamp = 40;
    for (int k = 0; k <= kRamp; ++k) {
      readings.push_back(low + (high - low) * k / kRamp);
      readings.push_back(k % 2 == 0 ? high : low);
    }
    for (int round = 0; round < 3; ++round) {
      for (const double reading : readings) {
        u[i] = reading;
        const auto samples = compensator.step(u);
        const bool valid = reading >= low && reading <= high && !kRefuses;
        for (std::size_t j = 0; j < m.joints.size(); ++j) {
          const Saturation& limit = limits(m, m.joints[j]);
          const double y = samples[j].angle_deg;  // finite and safe whatever the status
          if (!(y >= limit.lower_deg - 0.1 && y <= limit.upper_deg + 0.1)) return reading;
          if (valid && samples[j].status != core::Status::ok) return reading;
        }
      }
    }
  }
  return std::nullopt;
}

}  // namespace flexor::model
