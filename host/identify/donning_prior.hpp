// How a new donning differs from the one that a model was made in, before anything of it is seen: the standard deviation of the
// difference of two; python/flexor/donning.py writes it. Lengths are shares of a sensor's span: from the reading that
// 2 % of its samples do not exceed to that of 98 %.
//
// {"schema": "flexor-donning-prior", "schema_version": 1, "sessions", "shift_sd", "log_gain_sd", "motion_sd", "reach_sd",
//  "density_sd", "alike"}; files without "alike" are of before it was known, and have the shipped one.
#pragma once

#include <string>

#include "host/model/model.hpp"

namespace flexor::identify {

struct Prior {
  int sessions = 0;        // that it was learnt from
  double shift_sd = 0;     // of where a sensor's readings lie
  double log_gain_sd = 0;  // of how far apart they lie
  double alike = 0;        // correlation of the shifts of one glove's sensors
  // What quantiles of another stretch of motion differ by though nothing was put on anew:
  double motion_sd = 0;   // all together
  double reach_sd = 0;    // the distance of the ends
  double density_sd = 0;  // each quantile between the ends, by itself
};

inline constexpr double kGeneralWeight = 4;  // recordings that a general prior counts as
inline constexpr double kMostAlike = 0.95;

// Somewhat narrower than nine sessions of one three-finger glove over 4.5 months: docs/donning.md has the figures.
Prior shipped_prior();

// Throws io::InputError naming `source` and place.
Prior prior_from_json(const std::string& text, const std::string& source);

// Of one sensor: what the model's own recordings say, weighed against `general`, which counts as kGeneralWeight.
Prior prior_of(const model::Input& input, const Prior& general);

}  // namespace flexor::identify
