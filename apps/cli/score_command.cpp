#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/commands.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"
#include "host/score/score.hpp"

namespace flexor::cli {
namespace score_command {

struct Options {
  std::string reference;
  std::string estimate;
  std::string reference_column;
  std::string estimate_column;
  double estimate_offset_s = 0;
  recording::TimeOptions time;
  bool json = false;
};

// The only column, or the only one that ends in _deg.
std::string pick(const recording::Recording& r, const char* option) {
  if (r.columns.size() == 1) return r.columns.front().name;
  std::vector<std::string> angles;
  for (const auto& c : r.columns) {
    if (c.name.ends_with("_deg")) angles.push_back(c.name);
  }
  if (angles.size() == 1) return angles.front();
  std::string names;
  for (const auto& c : r.columns) names += (names.empty() ? "" : ", ") + c.name;
  throw io::InputError(fmt::format("{}: which column? give {}; there are: {}", r.source, option, names));
}

struct Angles {
  recording::Recording recording;
  std::string column;
  score::Angles angles() const {
    const recording::Series s = recording.series(column);
    return {s.t_s, s.value, recording::default_max_gap_s(s.t_s)};
  }
};

Angles read(const std::string& path, const std::string& column, const char* option,
            const recording::TimeOptions& time) {
  Angles a{column.empty() ? recording::read_csv(path, {}, time) : recording::read_angle(path, column, time),
           column};
  if (column.empty()) recording::leave_out_lost(a.recording, a.column = pick(a.recording, option));
  recording::to_degrees(a.recording, a.column, "");
  for (const std::string& warning : a.recording.warnings) log("note: " + warning);
  return a;
}

void run(const Options& o) {
  if (!std::isfinite(o.estimate_offset_s))
    throw io::InputError("--estimate-offset must be a number of seconds");
  const Angles measured = read(o.reference, o.reference_column, "--reference-column", o.time);
  Angles estimated = read(o.estimate, o.estimate_column, "--estimate-column", o.time);
  for (double& t : estimated.recording.t_s) t += o.estimate_offset_s;
  score::Score s;
  try {
    s = score::compare(measured.angles(), estimated.angles());
  } catch (const io::InputError& error) {
    throw io::InputError(fmt::format("{} and {}: {}; shift one with --estimate-offset", o.reference,
                                     o.estimate, error.what()));
  }
  if (s.left_out > 0) {
    log(fmt::format(
        "note: {} of {} samples of the estimate lie in gaps of the measured angle and are left out",
        s.left_out, s.left_out + s.samples));
  }
  if (s.lag_at_edge) {
    log("warning: the best lag lies at the edge of the search: are the two on the same clock? "
        "--estimate-offset shifts one");
  }
  if (o.json) {
    nlohmann::ordered_json json = score::to_json(s);
    json["version"] = FLEXOR_VERSION;
    print(io::dump(json));
    return;
  }
  print(
      fmt::format("samples           {}\n"
                  "RMSE              {:.3f} deg\n"
                  "largest           {:.3f} deg\n"
                  "95th percentile   {:.3f} deg\n"
                  "fit (NRMSE)       {:.2f} %\n"
                  "R2                {:.4f}\n"
                  "absolute error    {:.3f} deg s\n"
                  "best lag          {:+.3f} s (positive: the estimate is late)\n"
                  "without that lag  {:.3f} deg RMSE, {:.3f} deg s\n",
                  s.samples, s.rmse_deg, s.max_abs_deg, s.p95_abs_deg, s.fit_percent, s.r2, s.iae_deg_s,
                  s.best_lag_s, s.lag_removed_rmse_deg, s.lag_removed_iae_deg_s));
}

}  // namespace score_command

void add_score(CLI::App& app) {
  using namespace score_command;
  const auto [o, command] = add_command(app, "score", "Compare two CSV files of angles", run);
  command->add_option("reference", o->reference, "CSV with the measured angle")->required();
  command->add_option("estimate", o->estimate, "CSV with the estimated angle, on the same clock")->required();
  command->add_option("--reference-column", o->reference_column, "its column (default: the only angle)");
  command->add_option("--estimate-column", o->estimate_column, "its column (default: the only angle)");
  command->add_option("--estimate-offset", o->estimate_offset_s, "seconds to add to the estimate's clock")
      ->capture_default_str();
  add_time_options(*command, o->time);
}

}  // namespace flexor::cli
