// Two fits: the twin's free parameters to the published table, and a compensator to the twin's glove.
//
// calibrate_twin minimises
//   sum over gestures 1-4 and the three published compensators of (ln(ours / published) / 0.35)^2
//   + sum over the placements of ((bend - bend implied) / 16 deg)^2
// by Sbplx (NLopt) with common random numbers. The implied bend of a finger at its lower and upper limit is
// the mean of those at which either published compensator answers rightly; 16 degrees is how far these two
// are apart. Gestures 5 and 6 take no part.
//
// calibrate_glove does what a user does with a real glove: wears it, plays the calibration motion, logs the
// readings and a camera with a clock of its own, and identifies a compensator for each finger from the two
// files. A second recording with the hand connected gives the lag from finger to hand, which the last steps
// predict ahead.
#pragma once

#include <functional>

#include "host/study/trials.hpp"

namespace flexor::study {

struct FreeParameter {
  std::string name;  // of the twin's table, with ".finger" where it has one for each
  double start = 0;
  double min = 0;
  double max = 0;
  std::optional<double> implied;  // by the published compensators
};
std::vector<FreeParameter> free_parameters();

struct TwinFit {
  twin::Parameters parameters;
  double cost = 0;
  double log_rms = 0;  // gestures 1 to 4, with the trials of the fit
  int evaluations = 0;
};

using FitProgress = std::function<void(int evaluation, int of, double best_log_rms)>;

// trials: a multiple of 16 makes best use of the vectors.
TwinFit calibrate_twin(const twin::Parameters& start, int evaluations, int trials, std::uint64_t seed,
                       const FitProgress& progress);

struct GloveRequest {
  twin::Parameters parameters;
  double rate_hz = 10;
  int rounds = 16;            // of 30 s; the glove comes off and goes on in between
  std::uint64_t seed = 1001;  // other than the experiment's: another person, another donning
  std::filesystem::path folder;
};

// One compensator more each: what every step adds to the one before.
struct Step {
  std::string name;  // static-curve, dynamics, hysteresis, lead
  std::string what;
  model::Model model;
};

struct GloveCalibration {
  std::vector<Step> steps;  // the last is the result
  double lag_s = 0;         // from finger to hand, measured with the compensator of the step before the last
  std::vector<std::string> warnings;
};

using StepProgress = std::function<void(const std::string& what)>;

// Writes glove.csv, camera.csv, a model for each step, and the last once more as identified.json. Throws
// io::InputError and io::JobError.
GloveCalibration calibrate_glove(const GloveRequest& request, const StepProgress& progress);

}  // namespace flexor::study
