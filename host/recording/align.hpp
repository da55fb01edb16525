// Clock offset of two recordings of one motion, from their signals alone.
//
// Three stages, because the level of a glove sensor lies (hysteresis shifts it in time) and its motion does
// not:
//  1. For every offset with enough overlap: the correlation ratio eta^2 of the reference on the sensor, i.e.
//     the share of the reference's variance that any static function of the sensor explains (bins of equal
//     count). The offset with the largest n log(1 / (1 - eta^2)) wins. Blind to sign, scale and static
//     nonlinearity.
//  2. Around it: the largest correlation (either sign) of the two velocities, both smoothed by a Gaussian of
//     0.5 s; a parabola through the peak gives the fraction of a sample. It is the sensor's own velocity: a
//     curve fitted at a slightly wrong offset would pull the peak towards that offset.
//  3. From there the offset, the drift, the sensor's own lag and the cloth's play together (sensor_lag.hpp).
// Where both recordings hold one tapped synchronisation, it says which of the offsets that explain nearly as
// much as the best is meant.
// Recordings of less than half a minute get a narrower Gaussian and fewer bins.
//
// The confidence is the probability that the offset is right to 0.15 s:
//   1 / (1 + exp(12.7 - 5.5 r^2 - 9.1 s - 1.6 g^(1/2)))  that it is not another one, times
//   erf(0.15 s / (2^(1/2) 1.6 e))                        that it is determined well enough, over
//   1 + sum_j exp(9.1 (s_j - s) - (g_j / 0.1)^2 T / 2)   the offsets that explain as much, of a periodic motion one for
//                                                        each period, and for each half where it is symmetric
//   r  correlation of the velocities     s  overlap as a share of the shorter recording, which lasts T seconds
//   e  standard error                    g_j  ln((1 - eta_j^2) / (1 - eta^2)) of another local maximum of eta^2, 0 at least
//   g  the least of these; where taps agree at least 3, and no sum
// The numbers but 0.1 are a fit by maximum likelihood to 7000 stretches of 5 to 211 s, cut from recordings of a glove, two
// knees, a bending plate and a joint capsule, and simulated; pairs of different motions have a third of the weight.
// A share s below one counts against an offset: people start and stop the two recordings together.
// Source: A. Renyi, On measures of dependence (1959) for eta^2.
#pragma once

#include <array>
#include <optional>

#include "host/recording/recording.hpp"

namespace flexor::recording {

constexpr double kUnsure = 0.5;           // of a confidence: below it the clock is not determined
constexpr double kVelocityError_s = 0.1;  // of an offset from velocities alone

struct Alignment {
  // Reference time minus sensor time of the same instant.
  double clock_offset_s = 0;
  // Of that; none where the velocities do not line up.
  std::optional<double> clock_offset_se_s;
  // How much later the readings move than the angle: what the velocities alone would have made part of the offset.
  std::optional<double> sensor_lag_s;
  // As above. Below kUnsure a warning says why.
  double confidence = 0;
  double eta_squared = 0;
  double velocity_correlation = 0;  // of the smoothed velocities at the offset, 0 where they do not line up
  double overlap_s = 0;
  bool tapped = false;                   // a synchronisation that both recordings hold says so, too
  std::optional<double> rival_offset_s;  // the other offset that explains most
  // The offset found in each quarter of an overlap of 20 s or more, where that quarter moves enough to tell.
  std::array<std::optional<double>, 4> quarter_offset_s;
  // How much faster the reference's clock runs, where three quarters tell; of the velocities, or of stage 3, which
  // has an error for it.
  std::optional<double> drift_ppm;
  std::optional<double> drift_se_ppm;
  std::optional<std::string> jump;  // of one of the clocks, which is no drift: a warning
  std::vector<std::string> warnings;
};

// Throws io::JobError: overlap too short (2 s, or 40 % of the shorter recording), no offset at which the
// recordings correlate (eta^2 below 0.4), or quarters that clearly ask for a clock more than 1.2 % fast or
// slow: these are two takes, not one with drift. Deterministic; shifting either clock shifts the result and
// no more.
Alignment align(const Series& sensor, const Series& reference);

// A synchronisation that a finger taps: three quick bends in a row between two rests, as the recommended motion begins. The
// instants at which the bends turn back, on the series' clock. They go one way, by a quarter of the range or more, 0.3 to 1.5 s
// from one to the next, as long as one another within a factor of 1.6; a second before and behind them the series rests within
// a tenth of the range. None where there is no such triple, or more than one.
std::optional<std::array<double, 3>> taps(const Series& series);

// eta^2 of the reference on the sensor at this offset of their clocks, 0 where they hardly overlap.
double explained(const Series& sensor, const Series& reference, double clock_offset_s);

// The warning that a user's own offset deserves, if it is more than 0.15 s and four standard errors from the signals'.
std::optional<std::string> disagreement(double user_offset_s, const Alignment& found);

}  // namespace flexor::recording
