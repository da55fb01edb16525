#include <algorithm>

#include "apps/cli/commands.hpp"
#include "host/identify/compare.hpp"
#include "host/recording/unit.hpp"
#include "host/report/page.hpp"

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
std::vector<std::pair<std::string, std::string>> columns_of(const Options& o, const recording::Log& reference,
                                                            const recording::Log& estimate) {
  std::vector<std::pair<std::string, std::string>> out;
  if (o.reference_column.empty() && o.estimate_column.empty())
    for (const recording::Column& c : reference.memory()->columns) {
      const auto of = std::ranges::find_if(estimate.memory()->columns, [&](const recording::Column& e) {
        return is_angle(e) && recording::without_unit(e.name) == recording::without_unit(c.name);
      });
      if (is_angle(c) && of != estimate.memory()->columns.end()) out.emplace_back(c.name, of->name);
    }
  if (!out.empty()) return out;
  return {{o.reference_column.empty() ? pick(*reference.memory(), "--reference-column") : o.reference_column,
           o.estimate_column.empty() ? pick(*estimate.memory(), "--estimate-column") : o.estimate_column}};
}

// All columns, unless one is named.
recording::Log read(const std::string& path, const std::string& column, const recording::TimeOptions& time) {
  if (!column.empty()) return path;
  recording::Recording out = recording::read(*recording::open_log(path, {{}, time, recording::Holes::some}));
  for (const std::string& warning : out.warnings) log_note(warning);
  out.warnings.clear();
  return recording::Log(std::move(out));
}

Output run(const Options& o) {
  const recording::Log reference = read(o.reference, o.reference_column, o.time);
  const recording::Log estimate = read(o.estimate, o.estimate_column, o.time);
  const auto columns = columns_of(o, reference, estimate);
  std::vector<std::pair<std::string, Json>> scores;
  for (const auto& [measured, estimated] : columns) {
    const std::string joint = recording::without_unit(measured);
    const std::string place = columns.size() > 1 ? joint + ": " : "";
    const auto found =
        identify::compare(reference, measured, estimate, estimated, o.time, o.estimate_offset_s);
    for (const std::string& note : found.notes) log_note(place + note);
    for (const std::string& warning : found.warnings) log_warning(place + warning);
    scores.emplace_back(joint, found.score);
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
