#include "host/identify/identify_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

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

void name_columns(SourceFiles& files) {
  const auto only_column = [&](const std::filesystem::path& path, const char* option) {
    require_file(path, option);
    const std::vector<std::string> columns = recording::columns_of(path, files.time);
    if (columns.size() == 1) return columns.front();
    throw io::InputError(fmt::format("{}: which column? give {}; there are: {}", path.string(), option,
                                     fmt::join(columns, ", ")));
  };
  if (files.input.empty()) files.input = only_column(files.sensor, "--input");
  if (files.output.empty()) files.output = only_column(files.reference, "--output");
}

}  // namespace

recording::Pair load_pair(SourceFiles files) {
  name_columns(files);
  recording::Pair pair{recording::read_csv(files.sensor, {files.input}, files.time), files.input,
                       recording::read_angle(files.reference, files.output, files.time), files.output};
  recording::to_degrees(pair.reference, pair.output, files.output_unit);
  return pair;
}

OneJoint one_joint(SourceFiles files) {
  name_columns(files);
  for (const std::string& column : {files.input, files.output}) {
    for (const char* name : {"thumb", "index", "pointer", "middle", "ring", "pinky", "little"}) {
      if (recording::lower(column).find(name) != std::string::npos)
        return {{model::finger(name), {files.input}, files.output}, true};
    }
  }
  return {{"index", {files.input}, files.output}, false};
}

}  // namespace flexor::identify
