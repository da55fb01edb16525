#include "host/identify/recalibrate_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "host/identify/identify.hpp"
#include "host/identify/map_check.hpp"
#include "host/identify/readings.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

constexpr double kSwapped = 0.3;  // of two joints' explained motion

std::vector<double> without_holes(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  return values;
}

// A column for each input; a missing reading is NaN. The log continues where a reset of the board begins its clock again.
recording::Recording read_log(const recording::Log& path, const RecalibrationFiles& files,
                              const recording::TimeOptions& time, Recalibration& out) {
  const model::Model& model = files.model;
  const auto reader =
      recording::open_log(path, {model::columns_of(model, files.inputs), time, recording::Holes::all});
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    if (reader->units()[i].empty()) continue;
    if (auto note = unit_note(model.inputs[i], reader->name(), reader->columns()[i], reader->units()[i]))
      out.notes.push_back(std::move(*note));
  }
  recording::Recording log = recording::read(*reader, recording::Resets::follow);
  out.notes.insert(out.notes.end(), log.warnings.begin(), log.warnings.end());
  LogRanges& of = out.logs.emplace_back(LogRanges{log.source, reader->columns(), model::RangeCount(model)});
  std::vector<double> row(model.inputs.size());
  for (std::size_t k = 0; k < log.t_s.size(); ++k) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = log.columns[i].value[k];
    turn_into_range(model, row);
    of.ranges.add(row);
    for (std::size_t i = 0; i < row.size(); ++i) log.columns[i].value[k] = row[i];
  }
  for (std::size_t i = 0; i < row.size(); ++i) log.columns[i].name = model.inputs[i].name;
  return log;
}

// One sensor on the model's grid; NaN where nothing good was read: between a converter's rails, of anything else without spikes.
std::vector<double> sampled(const recording::Recording& log, const model::Model& model, std::size_t sensor) {
  const model::Input& input = model.inputs[sensor];
  const double gap_s = std::max(model.max_gap_s, recording::default_max_gap_s(log.t_s));
  const std::vector<double>& values = log.columns[sensor].value;
  recording::Range range{input.valid_min, input.valid_max};
  if (input.unit != "count") range = recording::without_spikes(values);
  recording::Samples s = recording::resample({log.t_s, values}, model.sample_period_s, gap_s, range);
  for (std::size_t k = 0; k < s.value.size(); ++k) {
    const bool is_good = !s.pause[k] && s.value[k] >= range.min && s.value[k] <= range.max;
    if (!is_good) s.value[k] = std::numeric_limits<double>::quiet_NaN();
  }
  return s.value;
}

// joint=column,...
std::map<std::string, std::string> columns_as_given(const std::string& map) {
  std::map<std::string, std::string> out;
  std::set<std::string> columns;
  std::istringstream list(map);
  for (std::string one; std::getline(list, one, ',');) {
    const std::size_t equal = one.find('=');
    if (equal == std::string::npos || equal + 1 == one.size())
      throw io::InputError("--map {}: joint=column,joint=column", map);
    const std::string column = one.substr(equal + 1);
    if (!out.emplace(model::joint_name(one.substr(0, equal)), column).second ||
        !columns.insert(column).second)
      throw io::InputError("--map {}: {} names a joint or a column again", map, one);
  }
  return out;
}

// Called like the joints. Of a model of one joint also the column that it was fitted to, or the only one.
std::map<std::string, std::string> columns_by_name(const RecalibrationFiles& files) {
  const model::Model& model = files.model;
  const auto columns = columns_of({files.pair_sensor, files.pair_camera}, true, files.time);
  const std::string& first = model.joints.front().name;
  const std::string fitted = model.training.value("output_column", first);
  std::map<std::string, std::string> out;
  for (const std::string& column : columns) {
    const std::string name = recording::lower(recording::without_unit(column));
    if (std::ranges::find(model.joints, name, &model::Joint::name) != model.joints.end())
      out.emplace(name, column);
    else if (model.joints.size() == 1 && (column == fitted || columns.size() == 1))
      out.emplace(first, column);
  }
  if (out.empty())
    throw io::InputError("{}: no column is called like a joint of the model: --map {}=COLUMN; it has {}",
                         files.pair_camera.string(), first, fmt::join(columns, ", "));
  return out;
}

// The own sensor is that on the joint's finger, or else the first.
std::vector<JointMap> map_of(const RecalibrationFiles& files) {
  const model::Model& model = files.model;
  const model::Graph graph(model);
  std::vector<JointMap> out;
  for (const auto& [joint, column] :
       files.map.empty() ? columns_by_name(files) : columns_as_given(files.map)) {
    const auto j = std::ranges::find(model.joints, joint, &model::Joint::name) - model.joints.begin();
    if (j == std::ssize(model.joints)) throw io::InputError("--map: the model has no joint {}", joint);
    JointMap& one = out.emplace_back(JointMap{joint, {}, column});
    const std::string finger = joint.substr(0, joint.find('_'));
    for (const std::size_t i : graph.inputs[graph.joint[static_cast<std::size_t>(j)]]) {
      const model::Input& input = model.inputs[i];
      one.sensors.insert(input.strip == finger ? one.sensors.begin() : one.sensors.end(), input.name);
    }
  }
  return out;
}

// An angle that states no unit and never leaves what a turn has of radians.
void refuse_radians(const recording::Recording& angle, const std::string& column) {
  const recording::Column& values = angle.column(column);
  const auto [low, high] = std::ranges::minmax(values.value);
  if (!values.unit.empty() || !(high > low) || std::max(std::abs(low), std::abs(high)) > std::numbers::pi)
    return;
  throw io::InputError(
      "{}: column \"{}\" goes from {:.2f} to {:.2f}, which looks like radians: call it {}_rad, "
      "or {}_deg if not",
      angle.source, column, low, high, column, column);
}

// A glove's log and what a camera saw meanwhile; a sensor that is not read stands still.
Take read_take(const RecalibrationFiles& files, const recording::TimeOptions& time,
               const recording::Recording& log, const std::vector<JointMap>& map,
               std::vector<std::string>& notes) {
  Take out{log, {}};
  for (std::size_t i = 0; i < files.model.inputs.size(); ++i) {
    recording::Column& column = out.sensor.columns[i];
    column = {column.name, recording::held_over(column.value, files.model.inputs[i].valid_min),
              files.model.inputs[i].unit};
  }
  for (const JointMap& joint : map) {
    recording::Recording& angle =
        out.reference.emplace_back(recording::read_angle(files.pair_camera, joint.reference, time));
    refuse_radians(angle, joint.reference);
    recording::to_degrees(angle, joint.reference, {});
    notes.insert(notes.end(), angle.warnings.begin(), angle.warnings.end());
  }
  return out;
}

// How much of the angles their joints' own sensors explain on this clock; every joint counts one.
double explained(const std::vector<JointMap>& map, const Take& take, double clock_offset_s) {
  double sum = 0;
  for (std::size_t j = 0; j < map.size(); ++j)
    sum += recording::explained(take.sensor.series(map[j].sensors.front()),
                                take.reference[j].series(map[j].reference), clock_offset_s);
  return sum;
}

// Two joints whose angles fit better the other way round, on the clock that they have then.
void refuse_swapped(const std::vector<JointMap>& map, const Take& take, double clock_offset_s) {
  const double as_given = explained(map, take, clock_offset_s);
  for (std::size_t b = 0; b < map.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      std::vector<JointMap> swapped = map;
      std::swap(swapped[a].sensors, swapped[b].sensors);
      Take again = take;
      std::vector<std::string> unused;
      try {
        const Clock clock = clock_of(swapped, {}, again, unused);
        if (explained(swapped, again, clock.offset_s) < as_given + kSwapped) continue;
      } catch (const io::JobError&) {
        continue;
      }
      throw io::InputError(
          "{}: \"{}\" moves as {} does and \"{}\" as {}: swap the two, with --map {}={},{}={}",
          take.reference[a].source, map[a].reference, map[b].joint, map[b].reference, map[a].joint,
          map[a].joint, map[b].reference, map[b].joint, map[a].reference);
    }
  }
}

// What comes of a hole, which is held over, does not count.
Seen seen_in(const std::vector<JointMap>& map, const Take& take, const recording::Recording& log,
             double clock_offset_s, const model::Model& model) {
  std::map<std::string, std::vector<double>> reading;
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    reading[model.inputs[i].name] = sampled(log, model, i);
  std::size_t size = reading.begin()->second.size();
  Seen out;
  for (std::size_t j = 0; j < map.size(); ++j) {
    recording::Aligned a;
    recording::sample_pair({take.sensor, map[j].sensors.front(), take.reference[j], map[j].reference},
                           1 / model.sample_period_s, clock_offset_s, 0, 1, a);
    const auto joint = std::ranges::find(model.joints, map[j].joint, &model::Joint::name);
    Seen::Angles& seen = out.joints.emplace_back(
        Seen::Angles{static_cast<std::size_t>(joint - model.joints.begin()), std::move(a.angle_deg), {}});
    for (std::size_t k = 0; k < a.size(); ++k)
      seen.use.push_back(!a.unseen[k] && std::ranges::none_of(map[j].sensors, [&](const auto& sensor) {
        return std::isnan(reading[sensor][k]);
      }));
    size = std::min(size, a.size());
  }
  // Columns of one file may end at other times: what all of them reach counts.
  for (const model::Input& input : model.inputs) {
    reading[input.name].resize(size);
    out.reading.push_back(recording::held_over(reading[input.name], input.valid_min));
  }
  for (auto& one : out.joints) {
    one.angle_deg.resize(size);
    one.use.resize(size);
  }
  return out;
}

// The glove's log of a pair that cannot be put on one clock says nothing either: it was given for the camera.
void add_pair(const RecalibrationFiles& files, RecalibrationRequest& request, Recalibration& out) {
  const auto time = recording::times_of_pair(files.pair_sensor, files.pair_camera, files.time);
  const recording::Recording log = read_log(files.pair_sensor, files, time, out);
  try {
    const std::vector<JointMap> map = map_of(files);
    Take take = read_take(files, time, log, map, out.notes);
    std::vector<std::string> unused;
    out.clock = clock_of(map, {}, take, unused);
    refuse_swapped(map, take, out.clock->offset_s);
    if (out.clock->confidence < recording::kUnsure)
      throw io::JobError("{}: what moved does not determine its clock (confidence {:.2f}): it does not count",
                         files.pair_camera.string(), out.clock->confidence);
    request.seen = seen_in(map, take, log, out.clock->offset_s, files.model);
    request.motion.push_back(motion_in(log, files.model));
  } catch (const io::JobError& error) {
    request.lacking.emplace_back(
        "glove and camera of one motion once more: twenty seconds in which the joints that the camera sees "
        "bend, not evenly");
    out.notes.emplace_back(error.what());
  }
}

}  // namespace

Motion motion_in(const recording::Recording& log, const model::Model& model) {
  Motion out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    out.reading.push_back(without_holes(sampled(log, model, i)));
  return out;
}

Held poses_in(const std::vector<std::string>& poses, const recording::Recording& log,
              const model::Model& model) {
  const auto is_known = [](const std::string& pose) { return pose == "open" || pose == "fist"; };
  if (poses.empty() || !std::ranges::all_of(poses, is_known))
    throw io::InputError("unknown poses \"{}\"; known: open, fist", fmt::join(poses, ","));
  if (poses.size() > 1 && std::ranges::count(poses, poses.front()) == std::ssize(poses))
    throw io::InputError(
        "poses \"{}\": name a pose that is held alone once, or both as they follow: open,fist",
        fmt::join(poses, ","));
  if (std::ranges::none_of(model.inputs, [](const auto& input) { return input.poses.has_value(); }))
    throw io::InputError(
        "{}: the model lacks what its sensors read at the open hand and at the fist: identify it again",
        log.source);
  std::vector<std::vector<double>> readings;
  std::vector<model::Spread> made;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    std::vector<double>& read = readings.emplace_back(sampled(log, model, i));
    made.push_back(input.poses ? spread_of(*input.poses) : model::Spread{{0, 1}, {0, 1}});
    if (input.poses && without_holes(read).size() * 2 >= read.size())
      read = recording::held_over(read, input.valid_min);
    else
      std::ranges::fill(read, std::numeric_limits<double>::quiet_NaN());  // it must not end a hold
  }
  Held out = poses_in(readings, model.sample_period_s, made, log.source);
  if (out.fist.empty() == (poses.size() > 1))
    throw io::JobError("{}: {} to be held, {} found", log.source, fmt::join(poses, " and "),
                       out.fist.empty() ? "one pose is" : "two poses are");
  if (poses.front() == "fist") std::swap(out.open, out.fist);
  return out;
}

Recalibration recalibrate_files(const RecalibrationFiles& files) {
  if (!files.map.empty() && files.pair_sensor.empty())
    throw io::InputError("--map names the columns of a camera's file: give --pair GLOVE CAMERA as well");
  RecalibrationRequest request{files.model};
  if (!files.prior.empty())
    request.prior = prior_from_json(io::read_document(files.prior), files.prior.string());
  Recalibration read;  // what is known of the files
  if (!files.recording.empty())
    request.motion.push_back(motion_in(read_log(files.recording, files, files.time, read), files.model));
  if (!files.poses_log.empty()) {
    const recording::Recording log = read_log(files.poses_log, files, files.time, read);
    try {
      request.held = poses_in(files.poses, log, files.model);
    } catch (const io::JobError& error) {
      request.lacking.emplace_back("the poses once more: hold each for two seconds, and still");
      read.notes.emplace_back(error.what());
    }
  }
  if (!files.pair_sensor.empty()) add_pair(files, request, read);
  Recalibration out = recalibrate(request);
  out.notes.insert(out.notes.begin(), read.notes.begin(), read.notes.end());
  out.clock = read.clock;
  out.logs = std::move(read.logs);
  return out;
}

Json to_json(const Recalibration& r) {
  Json out = {{"applied", r.applied}};
  Json sensors = Json::object();
  for (const RecalibratedSensor& s : r.sensors) {
    out["shift"][s.name] = s.correction.shift;
    out["gain"][s.name] = s.correction.gain;
    sensors[s.name] = {{"applied", s.applied},
                       {"shift_se", s.shift_se},
                       {"gain_se", s.gain_se},
                       {"gain_is_told", s.gain_is_known},
                       {"reversals", s.reversals},
                       {"covered", s.covered},
                       {"kept", s.kept}};
  }
  for (const RecalibratedJoint& joint : r.joints) {
    out["se_deg"][joint.name] = joint.se_deg;
    out["change_deg"][joint.name] = joint.change_deg;
    out["change_rms_deg"][joint.name] = joint.change_rms_deg;
  }
  out["wanted"] = r.wanted;
  out["misfits"] = r.misfits;
  out["sensors"] = std::move(sensors);
  out["clock_offset_s"] = r.clock ? Json(r.clock->offset_s) : Json();
  out["alignment_confidence"] = r.clock ? Json(r.clock->confidence) : Json();
  out["warnings"] = r.notes;
  out["version"] = FLEXOR_VERSION;
  return out;
}

}  // namespace flexor::identify
