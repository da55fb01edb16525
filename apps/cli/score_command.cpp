#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/cli/commands.hpp"
#include "host/experiment/identification.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace {

struct Options {
  std::string reference;
  std::string estimate;
  std::string reference_column;
  std::string estimate_column;
  double estimate_offset_s = 0;
  bool json = false;
};

// The column that was named, or the only one, or the only one that ends in _deg.
std::string pick(const recording::Recording& r, const std::string& wanted, const char* option) {
  if (!wanted.empty()) return r.column(wanted).name;
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

void run(const Options& o) {
  const auto read = [](const std::string& path, const std::string& column) {
    return recording::read_csv(path, column.empty() ? std::vector<std::string>() : std::vector{column});
  };
  const auto reference = read(o.reference, o.reference_column);
  const auto estimate = read(o.estimate, o.estimate_column);
  const auto measured = reference.series(pick(reference, o.reference_column, "--reference-column"));
  const auto estimated = estimate.series(pick(estimate, o.estimate_column, "--estimate-column"));
  for (const auto* r : {&reference, &estimate}) {
    for (const std::string& warning : r->warnings) log("warning: " + warning);
  }
  std::vector<double> estimate_t(estimated.t_s.begin(), estimated.t_s.end());
  for (double& t : estimate_t) t += o.estimate_offset_s;
  std::vector<double> t;
  std::vector<double> y;
  std::vector<double> value;
  for (std::size_t k = 0; k < measured.t_s.size(); ++k) {
    const double at = measured.t_s[k];
    if (at < estimate_t.front() || at > estimate_t.back()) continue;
    t.push_back(at);
    y.push_back(measured.value[k]);
    value.push_back(score::interpolate(estimate_t, estimated.value, at));
  }
  if (t.size() < 2) {
    throw io::InputError(
        fmt::format("{} and {} do not overlap in time ({:.1f}..{:.1f} s and {:.1f}..{:.1f} s); shift "
                    "one with --estimate-offset",
                    o.reference, o.estimate, measured.t_s.front(), measured.t_s.back(), estimate_t.front(),
                    estimate_t.back()));
  }
  const score::Score s = score::score(t, y, value);
  if (o.json) {
    nlohmann::ordered_json json = experiment::to_json(s);
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

}  // namespace

void add_score(CLI::App& app) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("score", "Compare two CSV files of angles");
  command->add_option("reference", o->reference, "CSV with the measured angle")->required();
  command->add_option("estimate", o->estimate, "CSV with the estimated angle, on the same clock")->required();
  command->add_option("--reference-column", o->reference_column, "its column (default: the only angle)");
  command->add_option("--estimate-column", o->estimate_column, "its column (default: the only angle)");
  command->add_option("--estimate-offset", o->estimate_offset_s, "seconds to add to the estimate's clock")
      ->capture_default_str();
  command->add_flag("--json", o->json, "one JSON object on standard output");
  command->callback([o] { run(*o); });
}

}  // namespace flexor::cli
