// The derivative of a Gaussian, which velocities are smoothed by; for this room only.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace flexor::recording {

// Standard deviation for a recording of so many seconds: constant from 20 s on.
inline double smoothing_s(double span_s) { return std::clamp(span_s / 40, 0.15, 0.5); }

// At -reach ... reach samples, reach three deviations of so many samples; as a correlation it is positive where the signal rises.
inline std::vector<double> derivative_kernel(double deviation) {
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(3 * deviation));
  std::vector<double> out;
  for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
    const double z = static_cast<double>(k) / deviation;
    out.push_back(z * std::exp(-z * z / 2));
  }
  return out;
}

}  // namespace flexor::recording
