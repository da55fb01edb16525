#include "host/identify/joint_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <optional>
#include <set>

#include "host/io/io.hpp"
#include "host/model/model.hpp"
#include "host/recording/align.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {

using io::InputError;

std::vector<std::string> short_names(const std::vector<std::filesystem::path>& paths) {
  const auto is_unique = [&](const std::filesystem::path& path, const auto& name) {
    return std::ranges::none_of(
        paths, [&](const auto& other) { return other != path && name(other) == name(path); });
  };
  const auto file = [](const std::filesystem::path& path) { return path.filename(); };
  const auto with_folder = [](const std::filesystem::path& path) {
    return path.parent_path().filename() / path.filename();
  };
  std::vector<std::string> out;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::filesystem::path& path = paths[i];
    out.push_back(io::to_utf8((is_unique(path, file)          ? file(path)
                               : is_unique(path, with_folder) ? with_folder(path)
                                                              : path)
                                  .string()));
    if (std::ranges::count(paths, path) > 1)
      out.back() += fmt::format(
          ", trial {}",
          std::ranges::count(paths.begin(), paths.begin() + static_cast<std::ptrdiff_t>(i), path) + 1);
  }
  return out;
}

namespace {

bool are_one(const PairFiles& files) {
  std::error_code error;
  return files.reference.memory() ? files.sensor.memory() == files.reference.memory()
                                  : std::filesystem::equivalent(files.sensor, files.reference, error);
}

std::string finger_part(const std::string& name) {
  std::string out = recording::lower(name.substr(0, name.find('_')));
  if (out == "little") return "pinky";
  return out == "pointer" ? "index" : out;
}

// Of thumb to pinky; five: no finger.
std::ptrdiff_t finger_place(const std::string& name) {
  return std::ranges::find(model::finger_names(), finger_part(name)) - model::finger_names().begin();
}

}  // namespace

std::vector<std::string> columns_of(const PairFiles& files, bool are_angles,
                                    const recording::TimeOptions& time) {
  const recording::Log& path = are_angles ? files.reference : files.sensor;
  if (!path.memory()) io::require_readable(path);
  if (!path.memory() && !std::filesystem::is_regular_file(path))
    throw InputError(
        "{}: a pipe or device can be read once only: name its column with {}, or beside --pair with --map",
        path.string(), are_angles ? "--output" : "--input");
  const bool is_one = are_one(files);
  const auto reader = recording::open_log(path, {{}, time});
  std::vector<std::string> out;
  for (std::size_t i = 0; i < reader->columns().size(); ++i) {
    const bool is_angle = reader->units()[i] == "deg" || reader->units()[i] == "rad";
    if (reader->columns()[i] == "gap") continue;  // of flexor align
    if (!is_one || is_angle == are_angles) out.push_back(reader->columns()[i]);
  }
  return out.empty() ? reader->columns() : out;
}

void refuse_unsure(const std::string& source, double clock_offset_s, double confidence,
                   const std::string& why) {
  if (confidence >= recording::kUnsure) return;
  throw io::JobError(
      "{}: what moved does not tell its clock: {:+.2f} s is right with a probability of {:.2f}, {:g} at "
      "least is needed. {}; or give --clock-offset",
      source, clock_offset_s, confidence, recording::kUnsure,
      why.empty() ? "Record longer, a motion that does not repeat itself, with three quick bends first"
                  : why);
}

std::vector<JointMap> map_by_name(const PairFiles& files, const recording::TimeOptions& time) {
  const std::vector<std::string> sensors = columns_of(files, false, time);
  const std::vector<std::string> references = columns_of(files, true, time);
  // The first sensor whose name is `start`, or goes on after it, whatever the case.
  const auto sensor_of = [&](const std::string& start,
                             const std::string& angle) -> std::optional<std::string> {
    for (const std::string& name : sensors) {
      const std::string plain =
          finger_part(name) + recording::lower(name.substr(std::min(name.find('_'), name.size())));
      const bool fits = plain == start || plain.starts_with(start + "_");
      if (fits && !(name == angle && are_one(files))) return name;
    }
    return std::nullopt;
  };
  std::vector<JointMap> out;
  for (const std::string& angle : references) {
    if (angle.ends_with("_quality") || angle == "host_s") continue;  // of flexor track and record
    const std::string joint = angle.substr(0, angle.rfind('_'));
    const std::string finger = finger_part(joint);
    auto input =
        sensor_of(finger + recording::lower(joint.substr(std::min(joint.find('_'), joint.size()))), angle);
    if (!input) input = sensor_of(finger, angle);  // index_adc for index_pip_deg
    if (input) out.push_back({model::joint_name(joint), {*input}, angle});
  }
  // Where some are fingers, or say that they are angles, a counter or a temperature in both files is no joint.
  const auto is_joint = [](const JointMap& one) {
    const std::string name = recording::lower(one.reference);
    return finger_place(one.joint) < 5 || name.ends_with("deg") || name.ends_with("rad") ||
           name.find("angle") != std::string::npos;
  };
  if (std::ranges::any_of(out, is_joint)) std::erase_if(out, std::not_fn(is_joint));
  if (out.empty())
    throw InputError(
        "no sensor and angle of one name, as index_adc and index_deg; say which belong together with --map. "
        "{} has {}; {} has {}",
        files.sensor.string(), recording::listed(sensors), files.reference.string(),
        recording::listed(references));
  return out;
}

std::vector<JointMap> with_neighbours(const std::vector<JointMap>& map,
                                      const std::vector<std::string>& columns) {
  std::vector<std::pair<std::ptrdiff_t, std::string>> known;
  for (const JointMap& joint : map) known.emplace_back(finger_place(joint.joint), joint.sensors.front());
  for (const std::string& column : columns) known.emplace_back(finger_place(column), column);
  std::vector<JointMap> out = map;
  for (JointMap& joint : out) {
    for (const auto& [place, sensor] : known) {
      const bool is_new = std::ranges::find(joint.sensors, sensor) == joint.sensors.end();
      const bool is_beside = std::abs(finger_place(joint.joint) - place) == 1;
      if (is_new && is_beside && place < 5 && finger_place(joint.joint) < 5) joint.sensors.push_back(sensor);
    }
  }
  return out;
}

std::vector<std::string> sensors_of(const std::vector<JointMap>& map) {
  std::vector<std::string> out;
  for (const JointMap& joint : map) {
    if (joint.sensors.empty()) throw InputError("{}: the map names no sensor of it", joint.joint);
    for (const std::string& sensor : joint.sensors)
      if (std::ranges::find(out, sensor) == out.end()) out.push_back(sensor);
  }
  return out;
}

std::vector<JointMap> parse_map(const std::string& text) {
  std::vector<JointMap> out;
  std::size_t at = 0;
  const auto fail = [&](std::size_t where, const std::string& what) {
    throw InputError(
        "--map: {} at \"{}\"; write JOINT=SENSOR:ANGLE,... as index=SensorA1:index_deg, several "
        "sensors with +",
        what, io::start_of(text.substr(where), 30));
  };
  while (at <= text.size()) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string item = text.substr(at, end - at);
    const std::size_t equals = item.find('=');
    const std::size_t colon = item.rfind(':');
    if (equals == std::string::npos || equals == 0) fail(at, "no joint");
    if (colon == std::string::npos || colon < equals || colon + 1 == item.size())
      fail(at + equals, "no angle");
    JointMap joint{model::joint_name(item.substr(0, equals)), {}, item.substr(colon + 1)};
    for (std::size_t from = equals + 1, to = 0; from <= colon; from = to + 1) {
      to = std::min(item.find('+', from), colon);
      if (to == from) fail(at + from, "no sensor");
      joint.sensors.push_back(item.substr(from, to - from));
    }
    const std::set<std::string> different(joint.sensors.begin(), joint.sensors.end());
    if (different.size() < joint.sensors.size()) fail(at, "a sensor twice");
    if (std::ranges::find(out, joint.joint, &JointMap::joint) != out.end()) fail(at, "a joint twice");
    if (joint.joint.ends_with("_se") || joint.joint.ends_with("_status"))
      fail(at, "a joint named like a column that apply adds");
    out.push_back(std::move(joint));
    at = end + 1;
  }
  return out;
}

namespace {

void name_columns(SourceFiles& files) {
  if (recording::is_video(files.reference))
    throw InputError("{}: a video needs --joints FILE, which says what is marked", files.reference.string());
  for (const bool is_angle : {false, true}) {
    std::string& name = is_angle ? files.output : files.input;
    if (!name.empty()) continue;
    const std::vector<std::string> columns =
        columns_of({files.sensor, files.reference}, is_angle, files.time);
    if (columns.size() != 1)
      throw InputError("{}: which column? give {}; there are: {}",
                       (is_angle ? files.reference : files.sensor).string(),
                       is_angle ? "--output" : "--input", recording::listed(columns));
    name = columns.front();
  }
}

}  // namespace

recording::Pair load_pair(SourceFiles files, bool clock_is_known) {
  name_columns(files);
  if (!clock_is_known) files.time = recording::times_of_pair(files.sensor, files.reference, files.time);
  recording::Pair pair{
      recording::read(*recording::open_log(files.sensor, {{files.input}, files.time})), files.input,
      recording::read_angle(files.reference, files.output,
                            recording::times_of_reference(files.sensor, files.reference, files.time)),
      files.output};
  recording::unwrap(pair.sensor, pair.input);
  recording::to_degrees(pair.reference, pair.output, files.output_unit);
  return pair;
}

OneJoint one_joint(SourceFiles files) {
  name_columns(files);
  for (const std::string& column : {files.input, files.output})
    for (const char* name : {"thumb", "index", "pointer", "middle", "ring", "pinky", "little"})
      if (recording::lower(column).find(name) != std::string::npos)
        return {{model::finger(name), {files.input}, files.output}, true};
  return {{"index", {files.input}, files.output}, false};
}

}  // namespace flexor::identify
