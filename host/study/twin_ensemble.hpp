// The laboratories that the published table leaves plausible.
//
// draw_ensemble draws the twin's free parameters (twin_prior.hpp) from
//   p(values | published averages of gestures 1 to 4)  ~  prior x likelihood       (twin_table.hpp)
// by Markov chains that start at draws of the prior. The twin's expectation is the mean of its trials with
// common random numbers; four digits of each value count, and are what the file says.
//
// An ensemble is a document: {"schema": "flexor-ensemble", "schema_version": 1, "written_by", "request",
// "chains", "parameters": [{name, prior, posterior, r_hat, effective}], "base": a twin's configuration,
// "laboratories": [[value of each parameter]]}.
#pragma once

#include <atomic>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/study/markov_chain.hpp"
#include "host/study/twin_prior.hpp"
#include "host/study/twin_table.hpp"

namespace flexor::study {

struct EnsembleRequest {
  twin::Parameters base;  // all that is not free
  int laboratories = 200;
  int evaluations = 12000;  // of the table, all chains together; a third of them warm up
  int chains = 8;
  int trials = 8;  // of each cell in an evaluation
  std::uint64_t seed = 7;
  int threads = 0;
  const std::atomic<bool>* stop = nullptr;    // becomes true: io::Cancelled
  TableErrors table = published_table(1, 4);  // what the laboratories must be like
};

struct Posterior {
  std::string name;
  double median = 0;
  double low = 0;   // 5 %
  double high = 0;  // 95 %
  double r_hat = 0;
  double effective = 0;
};

struct Ensemble {
  twin::Parameters base;
  std::vector<Point> values;  // of each laboratory, in the order of free_parameters()
  // How it was drawn.
  std::uint64_t seed = 0;
  int chains = 0;
  int warm_up = 0;  // steps of each chain
  int kept = 0;
  int trials = 0;
  double acceptance = 0;
  std::vector<Posterior> posterior;

  double worst_r_hat() const;
  // Why the laboratories may not be a sample of those that are plausible: the chains disagree. Empty: no reason.
  std::string doubt() const;
  double least_effective() const;
};

// Throws io::InputError: more laboratories than kept steps; io::Cancelled.
Ensemble draw_ensemble(const EnsembleRequest& request, const ChainProgress& progress);

std::string to_json(const Ensemble& ensemble);
// `source` names the text in errors. Throws io::InputError.
Ensemble ensemble_from_json(const std::string& text, const std::string& source);

// Quantiles 5, 50 and 95 % by linear interpolation; `values` is not empty.
struct Interval {
  double low = 0;
  double median = 0;
  double high = 0;
};
Interval interval90(std::vector<double> values);

}  // namespace flexor::study
