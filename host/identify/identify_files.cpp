#include "host/identify/identify_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;

// Twice is a file read: for its columns, then for its rows.
void require_file(const std::filesystem::path& path, const char* option) {
  io::require_readable(path);
  static constexpr std::array kVideos = {".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v"};
  if (std::ranges::find(kVideos, recording::lower(path.extension().string())) != kVideos.end())
    throw io::InputError(
        fmt::format("{}: a video needs --joints FILE, which says what is marked", path.string()));
  if (!std::filesystem::is_regular_file(path)) {
    throw io::InputError(fmt::format("{}: a pipe or device can be read once only: name the column with {}",
                                     path.string(), option));
  }
}

}  // namespace

recording::Pair load_pair(SourceFiles files) {
  const auto only_column = [&](const std::filesystem::path& path, const char* option) {
    require_file(path, option);
    const std::vector<std::string> columns = recording::columns_of(path, files.time_unit);
    if (columns.size() == 1) return columns.front();
    throw io::InputError(fmt::format("{}: which column? give {}; there are: {}", path.string(), option,
                                     fmt::join(columns, ", ")));
  };
  if (files.input.empty()) files.input = only_column(files.sensor, "--input");
  if (files.output.empty()) files.output = only_column(files.reference, "--output");
  recording::Pair pair{recording::read_csv(files.sensor, {files.input}, files.time_unit), files.input,
                       recording::read_angle(files.reference, files.output, files.time_unit), files.output};
  recording::to_degrees(pair.reference, pair.output, files.output_unit);
  return pair;
}

Identification identify_files(const FileRequest& request, const Progress& progress) {
  check(request);
  return identify(load_pair(request.files), request, progress);
}

Json to_json(const Identification& r) {
  Json rows = Json::array();
  for (const TableRow& row : r.rows) {
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
      {"channel", r.model.joints.front().name},
      {"structure", r.structure},
      {"structure_detail", r.structure_detail},
      {"verdict", verdict_of(r.holdout.rmse_deg, r.baseline.rmse_deg)},
      {"holdout", score::to_json(r.holdout)},
      {"holdout_without_gaps", r.holdout_without_gaps ? score::to_json(*r.holdout_without_gaps) : Json()},
      {"baseline_linear", score::to_json(r.baseline)},
      {"baseline_static_curve", score::to_json(r.static_curve)},
      {"fitted_rmse_deg", r.fit.rmse_deg},
      {"hold_drift_deg", r.hold_drift_deg ? Json(*r.hold_drift_deg) : Json(nullptr)},
      {"structures", std::move(rows)},
      {"parameters", r.model.fit.at("parameters")},
      {"fit_seconds", r.fit_seconds},
      {"version", FLEXOR_VERSION},
      {"warnings", r.warnings}};
}

}  // namespace flexor::identify
