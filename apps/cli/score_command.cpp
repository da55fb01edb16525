#include <algorithm>
#include <cmath>

#include "apps/cli/commands.hpp"
#include "host/recording/align.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"
#include "host/recording/unit.hpp"
#include "host/report/page.hpp"
#include "host/score/score.hpp"

namespace flexor::cli::score_command {

struct Options {
  std::string reference;
  std::string estimate;
  std::string reference_column;
  std::string estimate_column;
  double estimate_offset_s = 0;
  recording::TimeOptions time;
};

bool is_angle(const recording::Column& c) {
  return c.unit == "deg" && !recording::without_unit(c.name).ends_with("_se");
}

// The only column, or the only one in degrees.
std::string pick(const recording::Recording& r, const char* option) {
  std::vector<std::string> names, angles;
  for (const auto& c : r.columns) (is_angle(c) ? angles : names).push_back(c.name);
  if (angles.size() == 1) return angles.front();
  names.insert(names.begin(), angles.begin(), angles.end());
  if (names.size() == 1) return names.front();
  throw io::InputError("{}: which column? give {}; there are: {}", r.source, option,
                       recording::listed(names));
}

// Measured and estimated column: those that were named, else all angles that both files have by one name, else the only ones.
std::vector<std::pair<std::string, std::string>> columns_of(const Options& o,
                                                            const recording::Recording& reference,
                                                            const recording::Recording& estimate) {
  std::vector<std::pair<std::string, std::string>> out;
  for (const recording::Column& c : reference.columns) {
    const auto of = std::ranges::find_if(estimate.columns, [&](const recording::Column& e) {
      return is_angle(e) && recording::without_unit(e.name) == recording::without_unit(c.name);
    });
    if (is_angle(c) && of != estimate.columns.end()) out.emplace_back(c.name, of->name);
  }
  if (!out.empty() && o.reference_column.empty() && o.estimate_column.empty()) return out;
  return {{o.reference_column.empty() ? pick(reference, "--reference-column") : o.reference_column,
           o.estimate_column.empty() ? pick(estimate, "--estimate-column") : o.estimate_column}};
}

recording::Recording read(const std::string& path, const std::string& column,
                          const recording::TimeOptions& time) {
  recording::Recording out =
      column.empty() ? recording::read(*recording::open_log(path, {{}, time, recording::Holes::some}))
                     : recording::read_angle(path, column, time);
  for (const std::string& warning : out.warnings) log_note(warning);
  out.warnings.clear();
  return out;
}

recording::Recording angle_of(recording::Recording all, const std::string& column) {
  recording::leave_out_lost(all, column);
  all = recording::without_holes(all, column);
  recording::to_degrees(all, column, "");
  for (const std::string& warning : all.warnings) log_note(warning);
  return all;
}

// What the motion says of the two clocks; none where it says too little.
std::optional<recording::Alignment> clocks_of(const recording::Series& measured,
                                              const recording::Series& estimated) {
  try {
    recording::Alignment found = recording::align(estimated, measured);
    if (found.confidence >= recording::kUnsure) return found;
  } catch (const io::JobError&) {  // too short, or two motions
  }
  return {};
}

// `name`: of the joint, before its messages; empty: there is one alone.
Json score_of(const Options& o, const recording::Recording& measured, const std::string& column,
              const recording::Recording& estimated, const std::string& of, const std::string& name) {
  constexpr double kMoveTogether = 0.9;  // as eta^2
  constexpr double kDriftErrors = 4;     // standard errors
  const recording::Series y = measured.series(column), e = estimated.series(of);
  const auto clocks = clocks_of(y, e);
  const auto compared = [&](double by_s) {
    std::vector<double> t_s(e.t_s.begin(), e.t_s.end());
    for (double& t : t_s) t += by_s;
    return score::compare({y.t_s, y.value, recording::default_max_gap_s(y.t_s)},
                          {t_s, e.value, recording::default_max_gap_s(e.t_s)});
  };
  const double behind_s = clocks ? clocks->clock_offset_s : 0;
  const std::string shift = fmt::format("by their motion --estimate-offset {:.2f} puts the two on one clock",
                                        o.estimate_offset_s + behind_s);
  score::Score s;
  try {
    s = compared(0);
  } catch (const io::InputError& error) {
    throw io::InputError("{} and {}: {}{}; {}", o.reference, o.estimate, name, error.what(),
                         clocks ? shift : "shift one with --estimate-offset");
  }
  if (s.left_out > 0)
    log_note(fmt::format("{}{} of {} samples lie in gaps of the other file and are left out", name,
                         s.left_out, s.left_out + s.samples));
  const bool is_better = clocks && 2 * compared(behind_s).rmse_deg < s.lag_removed_rmse_deg;
  if (is_better) {
    log_warning(name + shift);
  } else if (clocks && s.r2 < 0 && clocks->eta_squared > kMoveTogether) {
    log_warning(name +
                "the two move together and yet are far apart: has one another zero or sign, or radians?");
  } else if (s.lag_at_edge) {
    log_warning(name +
                "the best lag lies at the edge of the search: are the two on the same clock? "
                "--estimate-offset shifts one");
  }
  if (clocks && clocks->drift_se_ppm && std::abs(*clocks->drift_ppm) > kDriftErrors * *clocks->drift_se_ppm &&
      std::abs(*clocks->drift_ppm) * 1e-6 * clocks->overlap_s > recording::kVelocityError_s) {
    log_warning(fmt::format("{}the measured angle's clock runs {:+.2f} % fast, which the error holds too",
                            name, *clocks->drift_ppm * 1e-4));
  }
  return s;
}

Output run(const Options& o) {
  const recording::Recording reference = read(o.reference, o.reference_column, o.time);
  recording::Recording estimate = read(o.estimate, o.estimate_column, o.time);
  for (double& t : estimate.t_s) t += o.estimate_offset_s;
  const auto columns = columns_of(o, reference, estimate);
  std::vector<std::pair<std::string, Json>> scores;
  for (const auto& [measured, estimated] : columns) {
    const std::string joint = recording::without_unit(measured);
    scores.emplace_back(
        joint, score_of(o, angle_of(reference, measured), measured, angle_of(estimate, estimated), estimated,
                        columns.size() > 1 ? joint + ": " : ""));
  }
  report::Page page("");
  page.table(report::scores_table("", scores));
  if (scores.size() == 1) return {scores.front().second, page.text()};
  Json joints;
  for (const auto& [joint, score] : scores) joints[joint] = score;
  return {{{"joints", joints}}, page.text()};
}

void add(CLI::App& app) {
  const auto [o, command] = add_command(app, "score", "Compare two CSV files of angles", run);
  command->add_option("reference", o->reference, "CSV with the measured angle")->required();
  command->add_option("estimate", o->estimate, "CSV with the estimated angle, on the same clock")->required();
  command->add_option("--reference-column", o->reference_column,
                      "its column (default: all angles that both have by one name, or the only one)");
  command->add_option("--estimate-column", o->estimate_column,
                      "its column (default: all angles that both have by one name, or the only one)");
  add_shown(*command, "--estimate-offset", o->estimate_offset_s, "seconds to add to the estimate's clock");
  add_time_options(*command, o->time);
}

}  // namespace flexor::cli::score_command
