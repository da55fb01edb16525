// The article's score of one trial, from what two cameras saw.
//
//   e_i = reference_i - hand_i,   E_i = integral |e_i| dt,   E_T = sum of E_i            degree-seconds
// by trapezoids over frames that are period_s apart, and E_T once more after the hand is moved earlier by the
// one lag, the same for all fingers, that makes it smallest. The first figure is causal: every lag counts.
// The second says how much of it was lag. It exists only where the smallest error lies inside the search: a
// hand that gets ever better the further it is moved has lost the motion, and no lag of its own. Source:
// Sensors 2019, 19(18), 3896, eqs. 9 and 10.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace flexor::score {

// The best constant lag and what is left without it.
struct LagRemoved {
  double lag_s = 0;  // positive: the hand comes late; searched from -0.2 to 0.6 in steps of 5 ms
  double total_error_deg_s = 0;
  bool operator==(const LagRemoved&) const = default;
};

struct TrialScore {
  std::vector<double> finger_error_deg_s;  // E_i
  double total_error_deg_s = 0;            // E_T
  std::optional<LagRemoved> lag_removed;   // none: the best lag is at an edge of the search
};

// One series for each finger, all of the same length; beyond its ends a series keeps its last value. Throws
// io::JobError when there are fewer than two frames or the lengths differ.
TrialScore score_trial(std::span<const std::vector<float>> reference_deg,
                       std::span<const std::vector<float>> hand_deg, double period_s);

}  // namespace flexor::score
