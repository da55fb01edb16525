// What the names on a command line mean: compensators, motions, scenarios.
#pragma once

#include <string>
#include <vector>

#include "host/io/pipe_json.hpp"
#include "host/model/model.hpp"
#include "host/twin/motion.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::study {

using twin::kFingers;

struct Compensator {
  std::string name;
  model::Model model;
};

// "raw", "published-w", "published-hw", or a model file; sampled at rate_hz. Throws io::InputError, listing
// the known.
Compensator compensator(const std::string& name, double rate_hz);

// Several of them. A model file is called by its stem, or by its whole path where that is the
// name of another compensator in the list or of a published one. Throws io::InputError for the same one
// twice.
std::vector<Compensator> compensators(const std::vector<std::string>& list, double rate_hz);

// Throws io::InputError unless `name` can stand in a table: not empty, no comma, quote or control character.
void require_name(const std::string& name, const std::string& what);

// "1-6", "1,3", files of gestures (.json) and of recorded motion (.csv, and .txt of GraspDB), separated by
// commas. Throws io::InputError: unknown, malformed, a name that cannot stand in a table, the same twice.
// `notes` gets what was repaired in recorded ones, a line each.
std::vector<twin::Motion> motions(const std::string& list, std::vector<std::string>* notes = nullptr);
// Of models/gestures. Throws std::out_of_range for any other name.
twin::Motion carried_motion(const std::string& name);
// To identify a compensator from; two minutes of a hand at work; thirty seconds of the same kind, for films.
inline twin::Motion recommended_motion() { return carried_motion("protocol"); }
inline twin::Motion ordinary_motion() { return carried_motion("ordinary"); }
inline twin::Motion short_motion() { return carried_motion("calibration"); }

// The experiment once more with a part of the twin changed.
struct Scenario {
  std::string name;
  std::vector<std::string> set = {};  // "radio.loss=0.05"
  double worn_s = 0;                  // so long before each trial, in ordinary_motion()
  double drift_turns_s = 0;           // meanwhile sensors drift the other way every so often; 0: never
  bool tracked = false;               // and the glove follows its sensors
  std::string recalibrated = {};      // and is recalibrated by what it read: "poses" or "motion"; empty: not
};
FLEXOR_PIPE(Scenario, name, set, worn_s, drift_turns_s, tracked, recalibrated)

// models/scenarios.json.
std::vector<Scenario> scenarios();
// Without that of ordinary use, which changes nothing, and those in which the glove is worn for minutes.
std::vector<Scenario> changed_scenarios();

}  // namespace flexor::study
