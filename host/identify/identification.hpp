// From a glove's log and measured angles to a compensator proven on data it never saw.
//
// clock offset from the signals -> the sensor on the compensator's grid, with past readings only -> the first
// part (in time) is fitted, the rest held out -> the model document runs over the whole log, as apply runs
// it, and is scored on the held-out part, beside a straight line through the fitted part. Samples in pauses
// of either log are not fitted. In those of the sensor they are scored, since the compensator must answer there too; in those of
// the reference nothing is known, and nothing is scored. The clock offset is a
// property of the two recordings and uses all of both; nothing else looks at the held-out part.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/identify/fit.hpp"
#include "host/identify/joint_fit.hpp"
#include "host/identify/select.hpp"
#include "host/model/channel.hpp"
#include "host/recording/pair.hpp"
#include "host/score/score.hpp"

namespace flexor::identify {

struct Request {
  double rate_hz = 20;
  double split = 0.5;              // share of the overlap that is fitted
  std::string structure = "auto";  // a family's name, or a text of structure_text.hpp
  std::optional<int> order;
  std::optional<int> knots;
  std::optional<int> plays;
  bool dead_zone = false;
  bool monotone = false;  // with auto: the best of the families, by cross-validation
  std::optional<double> clock_offset_s;
  double lead_s = 0;  // estimate the angle this far ahead, to make up for lag behind the compensator
  std::optional<std::string> channel;  // default: the finger in a column's name, else index
  std::string input_unit;              // of the sensor, where its column states none
};

// One line of the table of structures.
struct TableRow {
  std::string name;
  int parameters = 0;
  double fitted_rmse_deg = 0;
  std::optional<double> cross_validated_deg;
  score::Score holdout;
  std::string refusal;  // set: could not be fitted, the figures are empty
  bool chosen = false;
};

struct Identification {
  Request request;
  recording::Pair pair;
  recording::Aligned aligned;
  std::size_t holdout_begin = 0;              // first held-out sample
  std::string structure;                      // "additive" of auto, a family's name, or the text
  std::string structure_detail;               // "hw: 10 knots, order 2"
  Summary fit;                                // of a text: how well and from what, not theta and channel
  std::optional<double> cross_validated_deg;  // of what a text stands for, auto among others
  std::optional<double> hold_drift_deg;       // of the same, see hold.hpp
  std::vector<TableRow> rows;
  model::Model model;
  std::vector<double> estimated_deg;  // at every sample
  std::vector<double> baseline_deg;   // straight line through the fitted part
  score::Score holdout;
  std::optional<score::Score> holdout_without_gaps;  // none: all of it lies in pauses
  score::Score baseline;
  score::Score static_curve;  // through the fitted part, by least squares
  double fit_seconds = 0;
  std::vector<std::string> warnings;
};

// Throws io::InputError for a request that cannot be, before any work.
void check(const Request& request);

// Both columns of the pair named; its angle in degrees. Throws io::InputError and io::JobError.
Identification identify(recording::Pair pair, const Request& request, const Progress& progress);

}  // namespace flexor::identify
