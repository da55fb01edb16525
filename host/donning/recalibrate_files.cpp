#include "host/donning/recalibrate_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "host/donning/pose_evidence.hpp"
#include "host/io/io.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"
#include "host/recording/unit.hpp"

namespace flexor::donning {
namespace {

using Json = nlohmann::ordered_json;
using Columns = std::vector<std::vector<double>>;

std::vector<std::string> columns_for(const FileRequest& request, const model::Model& model) {
  if (!request.inputs.empty() && request.inputs.size() != model.inputs.size()) {
    throw io::InputError(
        fmt::format("the model has {} input(s), {} --input given; name one for each, in order",
                    model.inputs.size(), request.inputs.size()));
  }
  if (!request.inputs.empty()) return request.inputs;
  std::vector<std::string> out;
  for (const model::Input& input : model.inputs)
    out.push_back(input.column.empty() ? input.name : input.column);
  return out;
}

void check_units(const recording::CsvReader& reader, const model::Model& model,
                 std::vector<std::string>& notes) {
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const std::string& wanted = model.inputs[i].unit;
    const std::string& unit = reader.units()[i];
    if (unit == wanted || unit.empty()) continue;
    if (recording::known_unit(wanted)) {
      throw io::InputError(fmt::format("{}: column \"{}\" is in {}, the model's input {} takes {}",
                                       reader.name(), reader.columns()[i], unit, model.inputs[i].name,
                                       wanted));
    }
    notes.push_back(
        fmt::format("{}: column \"{}\" is in {}, the model's input {} states no unit: taken as the same",
                    reader.name(), reader.columns()[i], unit, model.inputs[i].name));
  }
}

// A log through the clock repair that apply has, a reset of the board included.
recording::Recording read_log(const std::filesystem::path& path, const FileRequest& request,
                              const model::Model& model, std::vector<std::string>& notes) {
  io::require_readable(path);
  std::ifstream file(path, std::ios::binary);
  recording::CsvReader reader(file, path.string(), {columns_for(request, model), request.time_unit});
  check_units(reader, model, notes);
  recording::Stream stream(reader, recording::Resets::follow);
  recording::Recording out;
  out.source = path.string();
  for (const std::string& column : reader.columns()) out.columns.push_back({column, {}});
  recording::Row row;
  while (stream.next(row)) {
    out.t_s.push_back(row.t_s);
    for (std::size_t i = 0; i < row.value.size(); ++i) out.columns[i].value.push_back(row.value[i]);
  }
  if (out.t_s.size() < 2)
    throw io::InputError(fmt::format("{}: no two rows with a reading of every input", out.source));
  for (const std::string& note : stream.notes()) notes.push_back(note);
  return out;
}

// Counts between the converter's rails; of anything else what was read, without spikes.
recording::Range range_of(const model::Input& input, const std::vector<double>& values) {
  if (input.unit == "count") return {input.valid_min, input.valid_max};
  return recording::without_spikes(values);
}

struct Sampled {
  Columns reading;  // of each input, every sample of the grid
  std::vector<std::vector<std::uint8_t>> good;
};

Sampled sampled(const recording::Recording& log, const model::Model& model) {
  const double gap_s = std::max(model.max_gap_s, recording::default_max_gap_s(log.t_s));
  Sampled out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const std::vector<double>& values = log.columns[i].value;
    const recording::Range range = range_of(model.inputs[i], values);
    const recording::Samples s = recording::resample({log.t_s, values}, model.sample_period_s, gap_s, range);
    out.reading.push_back(s.value);
    auto& good = out.good.emplace_back();
    for (std::size_t k = 0; k < s.value.size(); ++k)
      good.push_back(!s.pause[k] && s.value[k] >= range.min && s.value[k] <= range.max);
  }
  return out;
}

// Joint and its column in the camera's file.
using Columned = std::pair<std::size_t, std::string>;

std::vector<Columned> mapped(const std::string& map, const model::Model& model) {
  std::vector<Columned> out;
  for (std::size_t at = 0; at < map.size();) {
    const std::size_t end = std::min(map.find(',', at), map.size());
    const std::string one = map.substr(at, end - at);
    const std::size_t equal = one.find('=');
    if (equal == std::string::npos || equal + 1 == one.size())
      throw io::InputError(fmt::format("--map {}: joint=column,joint=column", map));
    const std::string name = model::joint_name(one.substr(0, equal));
    const auto joint = std::ranges::find(model.joints, name, &model::Joint::name);
    if (joint == model.joints.end())
      throw io::InputError(fmt::format("--map: the model has no joint {}", name));
    out.emplace_back(joint - model.joints.begin(), one.substr(equal + 1));
    at = end + 1;
  }
  return out;
}

std::vector<Columned> by_name(const FileRequest& request, const model::Model& model) {
  const auto columns = recording::columns_of(request.pair_camera, request.time_unit);
  std::vector<Columned> out;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const auto column = std::ranges::find_if(columns, [&](const std::string& c) {
      return c == model.joints[j].name || recording::cut_name(c).name == model.joints[j].name;
    });
    if (column != columns.end()) out.emplace_back(j, *column);
  }
  if (out.empty() && model.joints.size() == 1 && columns.size() == 1) out.emplace_back(0, columns.front());
  if (out.empty() && model.joints.size() == 1 && model.training.contains("output_column")) {
    const auto column = model.training.at("output_column").get<std::string>();
    if (std::ranges::find(columns, column) != columns.end()) out.emplace_back(0, column);
  }
  if (out.empty()) {
    throw io::InputError(
        fmt::format("{}: no column is called like a joint of the model: --map {}=COLUMN; it has {}",
                    request.pair_camera.string(), model.joints.front().name, fmt::join(columns, ", ")));
  }
  return out;
}

// The clock offset by the sensor that tells most.
double clock_offset(const recording::Recording& log, const recording::Recording& angle,
                    const std::string& column) {
  std::optional<recording::Alignment> best;
  std::string reason;
  for (const recording::Column& sensor : log.columns) {
    try {
      recording::Alignment a = recording::align({log.t_s, sensor.value}, angle.series(column));
      if (!best || a.confidence > best->confidence) best = std::move(a);
    } catch (const io::JobError& error) {
      reason = error.what();
    }
  }
  if (!best) throw io::JobError(reason);
  return best->clock_offset_s;
}

Seen seen_in(const FileRequest& request, recording::Recording log, const model::Model& model,
             std::vector<std::string>& notes) {
  const auto joints = request.map.empty() ? by_name(request, model) : mapped(request.map, model);
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    log.columns[i].unit = model.inputs[i].unit;
    log.columns[i].name = fmt::format("{}", i);  // two inputs may have one column
  }
  Seen out;
  std::optional<double> offset_s;
  for (const auto& [joint, column] : joints) {
    recording::Recording angle = recording::read_angle(request.pair_camera, column, request.time_unit);
    recording::to_degrees(angle, column, {});
    notes.insert(notes.end(), angle.warnings.begin(), angle.warnings.end());
    if (!offset_s) offset_s = clock_offset(log, angle, column);
    Seen::Angles& seen = out.joints.emplace_back();
    seen.joint = joint;
    for (std::size_t i = 0; i < model.inputs.size(); ++i) {
      recording::Aligned a;
      recording::sample_pair({log, log.columns[i].name, angle, column}, 1 / model.sample_period_s, *offset_s,
                             0, 1, a);
      if (i == 0) seen.angle_deg = a.angle_deg;
      if (i == 0) seen.use.assign(a.size(), 1);
      for (std::size_t k = 0; k < seen.use.size(); ++k) seen.use[k] &= !a.gap[k];
      if (out.reading.size() < model.inputs.size()) out.reading.push_back(a.input);
    }
  }
  // Columns of one file may end at other times: what all of them reach counts.
  std::size_t size = out.reading.front().size();
  for (const auto& one : out.joints) size = std::min(size, one.use.size());
  for (auto& one : out.reading) one.resize(size);
  for (auto& one : out.joints) {
    one.angle_deg.resize(size);
    one.use.resize(size);
  }
  return out;
}

void add_motion(Motion more, std::optional<Motion>& motion) {
  if (!motion) {
    motion = std::move(more);
    return;
  }
  for (std::size_t i = 0; i < more.reading.size(); ++i)
    motion->reading[i].insert(motion->reading[i].end(), more.reading[i].begin(), more.reading[i].end());
}

}  // namespace

Motion motion_in(const recording::Recording& log, const model::Model& model) {
  const Sampled all = sampled(log, model);
  Motion out;
  for (std::size_t i = 0; i < all.reading.size(); ++i) {
    auto& reading = out.reading.emplace_back();
    for (std::size_t k = 0; k < all.reading[i].size(); ++k) {
      if (all.good[i][k]) reading.push_back(all.reading[i][k]);
    }
  }
  return out;
}

std::vector<Hold> poses_in(const std::vector<std::string>& poses, const recording::Recording& log,
                           const model::Model& model) {
  std::vector<bool> fist;
  for (const std::string& pose : poses) {
    if (pose != "open" && pose != "fist")
      throw io::InputError(fmt::format("unknown pose \"{}\"; known: open, fist", pose));
    fist.push_back(pose == "fist");
  }
  const Sampled all = sampled(log, model);
  Columns moving = all.reading;
  for (std::size_t i = 0; i < moving.size(); ++i) {  // a sensor that reads nothing must not end a hold
    if (std::ranges::count(all.good[i], 1) * 2 < std::ssize(all.good[i])) std::ranges::fill(moving[i], 0.0);
  }
  std::vector<model::Spread> made;
  for (const model::Input& input : model.inputs) {
    if (!input.poses) {
      throw io::InputError(fmt::format(
          "{}: the model does not say what it read at the open hand and at the fist: identify it anew",
          input.name));
    }
    const auto [low, high] = std::minmax(input.poses->open, input.poses->fist);
    made.push_back({{0.05, 0.95}, {low, high}});
  }
  std::vector<Hold> holds = holds_in(moving, model.sample_period_s, made, fist);
  if (holds.empty()) {
    throw io::JobError(fmt::format(
        "{}: {} were to be held, each for a second or more, and are not found: hold still, 2 s each",
        log.source, fmt::join(poses, " and ")));
  }
  for (Hold& hold : holds) {
    for (std::size_t i = 0; i < moving.size(); ++i) {
      if (std::ranges::count(all.good[i], 1) * 2 < std::ssize(all.good[i]))
        hold.reading[i] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return holds;
}

Recalibration recalibrate_files(const FileRequest& files) {
  Request request;
  request.model = model::load(files.model);
  if (!files.prior.empty()) request.prior = load_prior(files.prior);
  std::vector<std::string> notes;
  if (!files.recording.empty())
    request.motion = motion_in(read_log(files.recording, files, request.model, notes), request.model);
  if (!files.poses_log.empty())
    request.holds =
        poses_in(files.poses, read_log(files.poses_log, files, request.model, notes), request.model);
  if (!files.pair_sensor.empty()) {
    const recording::Recording log = read_log(files.pair_sensor, files, request.model, notes);
    request.seen = seen_in(files, log, request.model, notes);
    add_motion(motion_in(log, request.model), request.motion);
  }
  Recalibration out = recalibrate(request);
  out.notes.insert(out.notes.begin(), notes.begin(), notes.end());
  return out;
}

Json to_json(const Recalibration& r) {
  Json out = {{"applied", r.applied}};
  Json sensors = Json::object();
  for (const SensorResult& s : r.sensors) {
    out["shift"][s.name] = s.correction.shift;
    out["gain"][s.name] = s.correction.gain;
    sensors[s.name] = {{"applied", s.applied},     {"shift_se", s.shift_se}, {"gain_se", s.gain_se},
                       {"reversals", s.reversals}, {"covered", s.covered},   {"kept", s.kept}};
  }
  for (const JointResult& joint : r.joints) {
    out["se_deg"][joint.name] = joint.se_deg;
    out["change_deg"][joint.name] = joint.change_deg;
  }
  out["wanted"] = r.wanted;
  out["misfits"] = r.misfits;
  out["sensors"] = std::move(sensors);
  out["warnings"] = r.notes;
  out["version"] = FLEXOR_VERSION;
  return out;
}

}  // namespace flexor::donning
