// How far an estimated angle is from the measured one.
//
// With e_k = y_k - estimate_k over n samples at t_k:
//   rmse        = sqrt(mean e^2)                                  degrees
//   max, p95    = largest and 95th percentile of |e|              degrees
//   fit percent = 100 (1 - |e|_2 / |y - mean y|_2)                NRMSE fit; 100 is perfect, below 0 worse
//                                                                 than the mean
//   r2          = 1 - sum e^2 / sum (y - mean y)^2
//   iae         = integral |e| dt, trapezoids                     degree-seconds; E_i of Sensors 2019,
//                                                                 19(18), 3896
// and the same rmse and iae after the one constant lag L is removed that makes the rmse smallest: the
// estimate at t beside the measured angle at t - L. It is the measured angle that is interpolated there:
// interpolation smooths, and would take an estimate's noise for a lag of half a sample.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "host/io/pipe_json.hpp"

namespace flexor::score {

struct Score {
  std::size_t samples = 0;
  std::size_t left_out = 0;  // samples of either inside gaps of the other
  double rmse_deg = 0;
  double max_abs_deg = 0;
  double p95_abs_deg = 0;
  double fit_percent = 0;
  double r2 = 0;
  double iae_deg_s = 0;
  double best_lag_s = 0;     // positive: the estimate comes late; searched in +-1 s
  bool lag_at_edge = false;  // no best lag inside the search: two clocks, or two motions
  double lag_removed_rmse_deg = 0;
  double lag_removed_iae_deg_s = 0;
};
FLEXOR_PIPE(Score, rmse_deg, fit_percent, r2, max_abs_deg, p95_abs_deg, iae_deg_s, best_lag_s, lag_at_edge,
            lag_removed_rmse_deg, lag_removed_iae_deg_s, samples, left_out)

// The three spans have the same length, at least 2; t_s never decreasing; all finite. Nothing is integrated
// over steps longer than max_step_s.
// Fit and R2 are NaN where the measured angle is constant.
Score score(std::span<const double> t_s, std::span<const double> measured_deg,
            std::span<const double> estimated_deg,
            double max_step_s = std::numeric_limits<double>::infinity());

// The same where `unseen` is 0; the others, at which nothing was measured, count as left out. Where the angle that was measured
// never changes all count, as if it had been.
Score score_seen(std::span<const double> t_s, std::span<const double> measured_deg,
                 std::span<const double> estimated_deg, std::span<const std::uint8_t> unseen,
                 double max_step_s = std::numeric_limits<double>::infinity());

// In words, where more than a hundredth of the samples was not measured, of a part that is "fitted" or "scored".
std::optional<std::string> in_words_left_out(std::size_t unseen, std::size_t of, const char* done);

// Angles as they stand in a log. Neighbours further apart than max_gap_s have nothing known between them.
struct Angles {
  std::span<const double> t_s;
  std::span<const double> angle_deg;
  double max_gap_s = std::numeric_limits<double>::infinity();
};

// The estimate at its own instants, beside the straight line between the measured neighbours; measured rows
// of one time count as their mean. Samples of either in gaps of the other are left out. Throws io::InputError
// when the two overlap by less than a second, io::JobError where the measured angle never changes.
Score compare(const Angles& measured, const Angles& estimated);

}  // namespace flexor::score
