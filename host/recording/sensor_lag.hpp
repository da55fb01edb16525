// The clocks' offset and the sensor's own lag, distinguished by what a sensor can do with the angles that bend it:
//
//   reading(t) = sum_j (f_j(x_j(t')) + c_j H_5s angle_j(t')) + noise,  t' = t + d + s (t - middle)
//   x_j = H_tau play_r(angle_j)   or   play_r(H_tau angle_j), whichever fits better
//
// d the offset, s the drift (how much faster the reference's clock runs), H_tau a first-order lag, f_j piecewise linear, c_j what creeps, all joints that bend the sensor together. A lag rounds a
// movement off where an offset only moves it. tau and r have half-normal priors, s a normal one of 3000 ppm: a
// recording that does not tell (the sensor does what no such model does, or the motion is slow) keeps the lag small and says so by
// the error.
//
// A third prior holds d to what velocities say (align.hpp), corrected by lag and play. The camera's noise
// that lag and play would take out of the residuals is put back: both are applied to the angles with as much noise once more.
//
// The error is that of this model. Of a sensor that is none such, as one of two lags, an error may be ten times as large.
//
// f_j and c_j by least squares inside, d, s, tau and r outside (variable projection); the noise is as correlated as the
// residuals are: n of them count as n / (1 + 2 sum_k rho_k), and whatever lies six deviations out does not count.
// Sources: G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; C. Geyer, Statist. Sci. 7 (1992) 473 (the sum's end).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "host/recording/recording.hpp"

namespace flexor::recording {

struct SensorLag {
  double clock_offset_s = 0;  // reference time minus sensor time of the same instant
  double standard_error_s = 0;
  double lag_s = 0;         // tau
  double play_deg = 0;      // r
  double drift_ppm = 0;     // s; where it is not clear the others are those of none
  double drift_se_ppm = 0;  // 0: not looked for
};

// Near an offset, at the recording's middle, that is wrong by less than a second, or a tenth of the shorter recording. The angles share a clock. `near_ppm`: the
// drift to begin with; none: it is zero. None where too little is left to tell:
// 50 readings within what the cameras saw.
std::optional<SensorLag> sensor_lag(const Series& sensor, const std::vector<Series>& angles, double near_s,
                                    std::optional<double> near_ppm = {});

// The derivative of a Gaussian, which velocities are smoothed by, here and in align.hpp.
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

// Whether a drift is one, and not the error of a measurement: three standard errors.
bool is_clear(double drift_ppm, double standard_error_ppm);

}  // namespace flexor::recording
