// The experiment in every laboratory of an ensemble.
//
// In each, the glove is worn and recorded once (glove_recording.hpp), the compensators are fitted to that
// recording (glove_fit.hpp), and the plan's motions are played with the plan's compensators and the fitted
// ones. What is kept of a laboratory is a row of laboratories.csv, in order, whatever the threads; a run that
// was cut off goes on where the file ends. Every figure is then a median with the 5 and 95 % quantiles over
// the laboratories.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/study/shape_check.hpp"
#include "host/study/trials.hpp"
#include "host/study/twin_ensemble.hpp"

namespace flexor::study {

struct EnsemblePlan {
  Ensemble ensemble;
  // But for its parameters: motions, compensators beside the fitted, seed, trials, threads, folder.
  Plan plan;
  std::vector<Scenario> scenarios;  // also played, with the compensators that were fitted in ordinary use
  double rate_hz = 10;
  std::uint64_t glove_seed = 1001;  // of the recordings; with the laboratory's number
};

// What is fitted in each laboratory, in the order of the tables.
const std::vector<std::string>& fitted_in_each();  // line, line-lead, published-hw-refitted, identified

struct LaboratoryRow {
  // E_T, mean of the trials: ordinary use, then scenario by scenario; motions inside, compensators innermost.
  std::vector<double> error_deg_s;
  std::optional<double> lag_s;    // that the lead predicts
  std::vector<double> shape_deg;  // shape_checks(), those that the plan allows
};

struct EnsembleResult {
  std::vector<std::string> motions;
  std::vector<int> gestures;  // 0: none of the published
  std::vector<std::string> compensators;
  std::vector<Scenario> scenarios;
  std::vector<ShapeCheck> shapes;  // what is checked; the values are in the rows
  std::vector<LaboratoryRow> rows;
  std::int64_t resumed = 0;
  double wall_s = 0;
  int threads = 1;

  // Laboratory by laboratory. `use`: 0 is ordinary use, n the n-th scenario.
  std::vector<double> errors(std::size_t motion, std::size_t compensator, std::size_t use = 0) const;
  // Compensator by another.
  std::vector<double> ratios(std::size_t motion, std::size_t compensator, std::size_t to,
                             std::size_t use = 0) const;
  // Geometric mean of the ratios over the motions.
  std::vector<double> mean_ratios(std::size_t compensator, std::size_t to, std::size_t use = 0) const;
  // Root mean square of ln(ours / published) over gestures from..to; empty where the run lacks one of them.
  std::vector<double> log_rms(int from, int to) const;
  std::size_t index(const std::string& compensator) const;  // compensators.size() where there is none
};

// Throws as run() in trials.hpp.
EnsembleResult run_ensemble(const EnsemblePlan& plan, const TrialProgress& progress);

// Everything but how long it took and on how many threads.
nlohmann::ordered_json to_json(const EnsembleResult& result, const EnsemblePlan& plan);

}  // namespace flexor::study
