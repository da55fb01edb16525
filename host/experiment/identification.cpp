#include "host/experiment/identification.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/io/json.hpp"
#include "host/recording/csv.hpp"

namespace flexor::experiment {
namespace {

using Json = nlohmann::ordered_json;

// The measured angle without what a tracker says it lost: NAME_deg has NAME_quality beside it.
recording::Recording read_reference(const SourceFiles& files) {
  constexpr std::string_view kUnit = "_deg";
  constexpr double kLost = 3;
  std::string quality;
  if (files.output.ends_with(kUnit))
    quality = files.output.substr(0, files.output.size() - kUnit.size()) + "_quality";
  const std::vector<std::string> columns = recording::columns_of(files.reference, files.time_unit);
  if (quality.empty() || std::ranges::find(columns, quality) == columns.end()) {
    return recording::read_csv(files.reference, {files.output}, files.time_unit);
  }
  recording::Recording r = recording::read_csv(files.reference, {files.output, quality}, files.time_unit);
  const std::vector<double> q = std::move(r.columns[1].value);
  r.columns.pop_back();
  std::size_t kept = 0;
  for (std::size_t k = 0; k < q.size(); ++k) {
    if (q[k] >= kLost) continue;
    r.t_s[kept] = r.t_s[k];
    r.columns[0].value[kept++] = r.columns[0].value[k];
  }
  if (kept < 2) {
    throw io::JobError(fmt::format("{}: {} is lost in every row", files.reference.string(), files.output));
  }
  r.t_s.resize(kept);
  r.columns[0].value.resize(kept);
  if (kept < q.size()) {
    r.warnings.push_back(fmt::format("{}: {} of {} rows of {} are lost and left out",
                                     files.reference.string(), q.size() - kept, q.size(), files.output));
  }
  return r;
}

}  // namespace

recording::Pair load_pair(SourceFiles files) {
  const auto only_column = [&](const std::filesystem::path& path, const char* option) {
    const std::vector<std::string> columns = recording::columns_of(path, files.time_unit);
    if (columns.size() == 1) return columns.front();
    throw io::InputError(fmt::format("{}: which column? give {}; there are: {}", path.string(), option,
                                     fmt::join(columns, ", ")));
  };
  if (files.input.empty()) files.input = only_column(files.sensor, "--input");
  if (files.output.empty()) files.output = only_column(files.reference, "--output");
  recording::Pair pair{recording::read_csv(files.sensor, {files.input}, files.time_unit), files.input,
                       read_reference(files), files.output};
  recording::to_degrees(pair.reference, pair.output, files.output_unit);
  return pair;
}

identify::Identification identify_files(const Request& request, const identify::Progress& progress) {
  identify::check(request);
  return identify::identify(load_pair(request.files), request, progress);
}

Json to_json(const identify::Identification& r) {
  Json rows = Json::array();
  for (const identify::TableRow& row : r.rows) {
    Json entry = {{"structure", row.name}, {"chosen", row.chosen}};
    if (!row.refusal.empty()) {
      entry["refusal"] = row.refusal;
    } else {
      entry["parameters"] = row.parameters;
      entry["fitted_rmse_deg"] = row.fitted_rmse_deg;
      if (row.cross_validated_deg) entry["cross_validated_rmse_deg"] = *row.cross_validated_deg;
      entry["holdout_rmse_deg"] = row.holdout.rmse_deg;
    }
    rows.push_back(std::move(entry));
  }
  return {
      {"clock_offset_s", r.aligned.clock_offset_s},
      {"alignment_confidence", r.aligned.alignment ? Json(r.aligned.alignment->confidence) : Json(nullptr)},
      {"channel", r.model.channels.front().name},
      {"structure", identify::name(r.fit.structure.family)},
      {"structure_detail", identify::describe(r.fit.structure)},
      {"holdout", score::to_json(r.holdout)},
      {"holdout_without_gaps", score::to_json(r.holdout_without_gaps)},
      {"baseline_linear", score::to_json(r.baseline)},
      {"fitted_rmse_deg", r.fit.rmse_deg},
      {"structures", std::move(rows)},
      {"parameters", r.model.fit.at("parameters")},
      {"fit_seconds", r.fit_seconds},
      {"version", FLEXOR_VERSION},
      {"warnings", r.warnings}};
}

}  // namespace flexor::experiment
