// What the names on a command line mean: compensators, motions, scenarios, and the article's figures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/model/model.hpp"
#include "host/twin/motion.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::experiment {

using twin::kFingers;

struct Compensator {
  std::string name;
  model::Model model;
};

// "raw", "published-w", "published-hw", or a model file; sampled at rate_hz. Throws io::InputError, listing
// the known.
Compensator compensator(const std::string& name, double rate_hz);

// "1-6", "1,3", files of gestures (.json) and of recorded motion (.csv, and .txt of GraspDB), separated by
// commas.
std::vector<twin::Motion> motions(const std::string& list);
twin::Motion calibration_motion();

// The twin's configuration as shipped: fitted to the published averages of gestures 1 to 4.
twin::Parameters shipped_parameters();

// The experiment once more with a part of the twin changed.
struct Scenario {
  std::string name;
  std::vector<std::string> set;  // "radio.loss=0.05"
};

// models/scenarios.json.
std::vector<Scenario> scenarios();

// The article's average of three trials: gesture 1 to 6; "raw", "published-w", "published-hw".
std::optional<double> published_error_deg_s(int gesture, const std::string& compensator);

}  // namespace flexor::experiment
