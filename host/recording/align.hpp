// Clock offset of two recordings of one motion, from their signals alone.
//
// Two stages, because the level of a glove sensor lies (hysteresis shifts it in time) and its motion does
// not:
//  1. For every offset with enough overlap: the correlation ratio eta^2 of the reference on the sensor, i.e.
//  the
//     share of the reference's variance that any static function of the sensor explains (bins of equal
//     count). The offset with the largest n log(1 / (1 - eta^2)) wins. Blind to sign, scale and static
//     nonlinearity.
//  2. Around it: the largest correlation (either sign) of the two velocities, both smoothed by a Gaussian of
//     0.5 s; a parabola through the peak gives the fraction of a sample. It is the sensor's own velocity: a
//     curve fitted at a slightly wrong offset would pull the peak towards that offset.
// Source: A. Renyi, On measures of dependence (1959) for eta^2.
#pragma once

#include <array>
#include <optional>

#include "host/recording/recording.hpp"

namespace flexor::recording {

struct Alignment {
  // Reference time minus sensor time of the same instant.
  double clock_offset_s = 0;
  // 1 - (1 - eta^2) / (1 - eta^2 of the best other offset): the share of what the second best offset leaves
  // unexplained that this one explains. 0: ambiguous, 1: certain.
  double confidence = 0;
  double eta_squared = 0;
  double overlap_s = 0;
  std::optional<double> rival_offset_s;  // the best other offset, at least 2 s away
  // The offset found in each quarter of the overlap, where that quarter moves enough to tell.
  std::array<std::optional<double>, 4> quarter_offset_s;
  std::optional<double> drift_ppm;  // of the reference's clock against the sensor's, when three quarters tell
  // Stage 1, for a picture: eta^2 over the offset.
  std::vector<double> scan_offset_s;
  std::vector<double> scan_eta_squared;
  std::vector<std::string> warnings;
};

// Throws io::JobError: overlap too short (20 s, or 40 % of the shorter recording), or no offset at which the
// recordings correlate (eta^2 below 0.4). Deterministic; shifting either clock shifts the result and no more.
Alignment align(const Series& sensor, const Series& reference);

// The warning that a user's own offset deserves, if it is more than 0.5 s from the signals'.
std::optional<std::string> disagreement(double user_offset_s, const Alignment& found);

}  // namespace flexor::recording
