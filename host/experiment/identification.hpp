// From two log files to a compensator proven on data it never saw.
//
// read both -> clock offset from the signals -> one uniform grid over the overlap -> the first part (in time)
// is fitted, the rest held out -> the model document is simulated over the whole recording by
// runtime/compensator and scored on the held-out part, beside a straight line through the fitted part.
// Samples in pauses of either log are not fitted. They are scored: the compensator must answer there too.
// The clock offset is a property of the two files and uses all of both; nothing else looks at the held-out
// part.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/fit.hpp"
#include "host/identify/select.hpp"
#include "host/model/model.hpp"
#include "host/recording/align.hpp"
#include "host/recording/recording.hpp"
#include "host/recording/resample.hpp"
#include "host/score/score.hpp"

namespace flexor::experiment {

struct SourceFiles {
  std::filesystem::path sensor;
  std::filesystem::path reference;
  std::string input;   // column of the sensor file; empty: its only column of numbers
  std::string output;  // column of the reference file, degrees; likewise
};

// Fills in the columns that were left out. Throws io::InputError, listing the columns, where there are
// several.
SourceFiles with_columns(SourceFiles files);

// Both recordings on one grid, in the sensor's clock.
struct Aligned {
  recording::Recording sensor;
  recording::Recording reference;
  recording::Alignment alignment;
  double clock_offset_s = 0;  // used: the user's, or the signals'
  recording::Grid grid;
  std::vector<double> input;
  std::vector<double> angle_deg;
  std::vector<std::uint8_t> gap;
  std::vector<std::string> warnings;
};

// Both columns named; rate_hz > 0. The angle is the one lead_s ahead: a compensator that is fitted to it
// predicts. Throws io::InputError and io::JobError.
Aligned align_files(const SourceFiles& files, double rate_hz, std::optional<double> clock_offset_s,
                    double lead_s = 0);

// t_s, input, output and gap columns, for wide CSV and MAT.
recording::Recording to_recording(const Aligned& aligned, const SourceFiles& files);

struct Request {
  SourceFiles files;
  double rate_hz = 20;
  double split = 0.5;              // share of the overlap that is fitted
  std::string structure = "auto";  // or a family's name
  std::optional<int> order;
  std::optional<int> knots;
  std::optional<int> plays;
  bool dead_zone = false;
  bool monotone = false;
  std::optional<double> clock_offset_s;
  double lead_s = 0;  // estimate the angle this far ahead, to make up for lag behind the compensator
  std::optional<std::string> channel;  // default: the finger in a column's name, else index
};

// One line of the table of structures.
struct Row {
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
  Aligned aligned;
  std::size_t holdout_begin = 0;  // first held-out sample of the grid
  identify::Summary fit;
  std::vector<Row> rows;
  model::Model model;
  std::vector<double> estimated_deg;  // over the whole grid
  std::vector<double> baseline_deg;   // straight line through the fitted part
  score::Score holdout;
  score::Score holdout_without_gaps;
  score::Score baseline;
  double fit_seconds = 0;
  std::vector<std::string> warnings;
};

Identification identify_files(const Request& request, const identify::Progress& progress);

// The machine-readable result; see docs/json.md.
nlohmann::ordered_json to_json(const Identification& result);
nlohmann::ordered_json to_json(const score::Score& score);

}  // namespace flexor::experiment
