// The twin's free parameters fitted to the published table.
//
// calibrate_twin minimises
//   sum over gestures 1-4 and the three published compensators of (ln(ours / published) / 0.35)^2
//   - 2 log_prior                                                                    (twin_prior.hpp)
// by Sbplx (NLopt) with common random numbers. All cells weigh alike, as in the distance that is reported;
// what twin_ensemble.hpp draws weighs them by the spread of the published trials. Gestures 5 and 6 take no
// part.
#pragma once

#include <functional>

#include "host/study/twin_prior.hpp"
#include "host/study/twin_table.hpp"

namespace flexor::study {

struct TwinFit {
  twin::Parameters parameters;
  double cost = 0;
  double log_rms = 0;  // of ln(ours / published), gestures 1 to 4, with the trials of the fit
  int evaluations = 0;
};

using FitProgress = std::function<void(int evaluation, int of, double best_log_rms)>;

// trials: a multiple of 16 makes best use of the vectors.
TwinFit calibrate_twin(const twin::Parameters& start, int evaluations, int trials, std::uint64_t seed,
                       const FitProgress& progress);

}  // namespace flexor::study
