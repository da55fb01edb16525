// What the article says of curves and prints no number for, as numbers with a threshold. They are reported,
// and nothing is fitted to them.
//   gesture 2  "large fluctuations in rho_2 and rho_3" without a compensator, where the person keeps index and
//              middle still: swing of the hand's angle, from its smallest to its largest, with Raw; mean over
//              the trials, the smaller of both fingers. Large: 20 degrees or more, a quarter of their range.
//   gesture 4  "no significant deviations" of rho_3, rho_4 and rho_5 from rho_r with any of the compensators:
//              mean |e_i| over the gesture, E_i / duration, the largest of three fingers and three
//              compensators. Not significant: 5 degrees or less.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

inline constexpr double kLargeSwing_deg = 20;
inline constexpr double kSignificant_deg = 5;

struct ShapeCheck {
  int gesture = 0;
  std::string what;   // "swing of index and middle with raw"
  std::string where;  // what sets the value: "raw, ring"
  double value_deg = 0;
  double threshold_deg = 0;
  bool is_least = false;  // the threshold is the least that agrees with the article; else the most
  bool agrees() const { return is_least ? value_deg >= threshold_deg : value_deg <= threshold_deg; }
};

// Those that the run allows: gesture 2 with raw, gesture 4 with all three published.
std::vector<ShapeCheck> shape_checks(const Result& result, const Plan& plan);

nlohmann::ordered_json to_json(const std::vector<ShapeCheck>& checks);

}  // namespace flexor::study
