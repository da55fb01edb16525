#include "host/identify/identify_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

void name_columns(SourceFiles& files) {
  if (recording::is_video(files.reference))
    throw io::InputError(
        fmt::format("{}: a video needs --joints FILE, which says what is marked", files.reference.string()));
  for (const bool is_angle : {false, true}) {
    std::string& name = is_angle ? files.output : files.input;
    if (!name.empty()) continue;
    const std::vector<std::string> columns =
        columns_of({files.sensor, files.reference}, is_angle, files.time);
    if (columns.size() != 1)
      throw io::InputError(fmt::format("{}: which column? give {}; there are: {}",
                                       (is_angle ? files.reference : files.sensor).string(),
                                       is_angle ? "--output" : "--input", recording::listed(columns)));
    name = columns.front();
  }
}

}  // namespace

recording::Pair load_pair(SourceFiles files, bool clock_is_known) {
  name_columns(files);
  if (!clock_is_known) files.time = recording::times_of_pair(files.sensor, files.reference, files.time);
  recording::Pair pair{recording::read(*recording::open_log(files.sensor, {{files.input}, files.time})),
                       files.input, recording::read_angle(files.reference, files.output, files.time),
                       files.output};
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
