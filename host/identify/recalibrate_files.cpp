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

#include "host/identify/hand.hpp"
#include "host/identify/map_check.hpp"
#include "host/identify/readings.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kSwapped = 0.3;  // of two joints' explained motion

std::vector<double> without_holes(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  return values;
}

// A column for each input; a missing reading is NaN. The log continues where a reset of the board begins its clock anew.
recording::Recording read_log(const recording::Log& path, const RecalibrationFiles& request,
                              const recording::TimeOptions& time, const model::Model& model,
                              std::vector<std::string>& notes) {
  const auto reader =
      recording::open_log(path, {model::columns_of(model, request.inputs), time, recording::Holes::all});
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    if (reader->units()[i].empty()) continue;
    if (auto note = unit_note(model.inputs[i], reader->name(), reader->columns()[i], reader->units()[i]))
      notes.push_back(std::move(*note));
  }
  recording::Recording out = recording::read(*reader, recording::Resets::follow);
  notes.insert(notes.end(), out.warnings.begin(), out.warnings.end());
  return out;
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

// A hole is what was read before it, or else the first that was read.
std::vector<double> held_over(std::vector<double> values, const model::Input& input) {
  const auto first = std::ranges::find_if(values, [](double v) { return !std::isnan(v); });
  double last = first == values.end() ? input.valid_min : *first;
  for (double& v : values) last = v = std::isnan(v) ? last : v;
  return values;
}

// joint=column,... of joints that the model has.
std::map<std::string, std::string> columns_by_joint(const std::string& map) {
  std::map<std::string, std::string> out;
  std::set<std::string> columns;
  std::istringstream list(map);
  for (std::string one; std::getline(list, one, ',');) {
    const std::size_t equal = one.find('=');
    if (equal == std::string::npos || equal + 1 == one.size())
      throw io::InputError(fmt::format("--map {}: joint=column,joint=column", map));
    const std::string column = one.substr(equal + 1);
    if (!out.emplace(model::joint_name(one.substr(0, equal)), column).second ||
        !columns.insert(column).second)
      throw io::InputError(fmt::format("--map {}: {} names a joint or a column again", map, one));
  }
  return out;
}

std::map<std::string, std::string> columns_by_name(const RecalibrationFiles& request,
                                                   const model::Model& model) {
  const auto columns = columns_of({request.pair_sensor, request.pair_camera}, true, request.time);
  const std::string first = model.joints.front().name;
  std::map<std::string, std::string> out;
  for (const std::string& column : columns) {
    const std::string name = recording::lower(recording::without_unit(column));
    if (std::ranges::find(model.joints, name, &model::Joint::name) != model.joints.end())
      out.emplace(name, column);
  }
  const std::string fitted = model.training.value("output_column", first);
  if (out.empty() && model.joints.size() == 1) {
    if (columns.size() == 1) out[first] = columns.front();
    if (std::ranges::find(columns, fitted) != columns.end()) out[first] = fitted;
  }
  if (out.empty()) {
    throw io::InputError(
        fmt::format("{}: no column is called like a joint of the model: --map {}=COLUMN; it has {}",
                    request.pair_camera.string(), first, fmt::join(columns, ", ")));
  }
  return out;
}

// Sensors by their numbers: two inputs may have one column. The own one is that on the joint's finger, or else the first.
std::vector<JointMap> map_of(const RecalibrationFiles& files, const model::Model& model) {
  const model::Graph graph(model);
  std::vector<JointMap> out;
  for (const auto& [joint, column] :
       files.map.empty() ? columns_by_name(files, model) : columns_by_joint(files.map)) {
    const auto j = std::ranges::find(model.joints, joint, &model::Joint::name) - model.joints.begin();
    if (j == std::ssize(model.joints))
      throw io::InputError(fmt::format("--map: the model has no joint {}", joint));
    std::vector<std::size_t> sensors = graph.inputs[graph.joint[static_cast<std::size_t>(j)]];
    const std::string finger = joint.substr(0, joint.find('_'));
    std::stable_partition(sensors.begin(), sensors.end(),
                          [&](std::size_t i) { return model.inputs[i].strip == finger; });
    JointMap& one = out.emplace_back(JointMap{joint, {}, column});
    for (const std::size_t i : sensors) one.sensors.push_back(std::to_string(i));
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
      fmt::format("{}: column \"{}\" goes from {:.2f} to {:.2f}, which looks like radians: call it {}_rad, "
                  "or {}_deg if not",
                  angle.source, column, low, high, column, column));
}

// A glove's log and what a camera saw meanwhile; a sensor that is not read stands still.
HandRecordings read_take(const RecalibrationFiles& files, const recording::TimeOptions& time,
                         const recording::Recording& log, const std::vector<JointMap>& map,
                         const model::Model& model, std::vector<std::string>& notes) {
  HandRecordings out{log, {}};
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    out.sensor.columns[i] = {std::to_string(i), held_over(log.columns[i].value, model.inputs[i]),
                             model.inputs[i].unit};
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
double explained(const std::vector<JointMap>& map, const HandRecordings& take, double clock_offset_s) {
  double sum = 0;
  for (std::size_t j = 0; j < map.size(); ++j)
    sum += recording::explained(take.sensor.series(map[j].sensors.front()),
                                take.reference[j].series(map[j].reference), clock_offset_s);
  return sum;
}

// Two joints whose angles fit better the other way round, on the clock that they have then.
void refuse_swapped(const std::vector<JointMap>& map, const HandRecordings& take, double clock_offset_s) {
  const double as_given = explained(map, take, clock_offset_s);
  for (std::size_t b = 0; b < map.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      std::vector<JointMap> swapped = map;
      std::swap(swapped[a].sensors, swapped[b].sensors);
      HandRecordings again = take;
      std::vector<std::string> unused;
      try {
        const Clock clock = clock_of(swapped, {}, again, unused);
        if (explained(swapped, again, clock.offset_s) < as_given + kSwapped) continue;
      } catch (const io::JobError&) {
        continue;
      }
      throw io::InputError(
          fmt::format("{}: \"{}\" moves as {} does and \"{}\" as {}: swap the two, with --map {}={},{}={}",
                      take.reference[a].source, map[a].reference, map[b].joint, map[b].reference,
                      map[a].joint, map[a].joint, map[b].reference, map[b].joint, map[a].reference));
    }
  }
}

// What comes of a hole, which is held over, does not count.
Seen seen_in(const std::vector<JointMap>& map, const HandRecordings& take, const recording::Recording& log,
             double clock_offset_s, const model::Model& model) {
  std::vector<std::vector<double>> reading;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) reading.push_back(sampled(log, model, i));
  std::size_t size = reading.front().size();
  Seen out;
  for (std::size_t j = 0; j < map.size(); ++j) {
    recording::Aligned a;
    recording::sample_pair({take.sensor, map[j].sensors.front(), take.reference[j], map[j].reference},
                           1 / model.sample_period_s, clock_offset_s, 0, 1, a);
    Seen::Angles& seen = out.joints.emplace_back(Seen::Angles{0, std::move(a.angle_deg), {}});
    seen.joint = static_cast<std::size_t>(std::ranges::find(model.joints, map[j].joint, &model::Joint::name) -
                                          model.joints.begin());
    for (std::size_t k = 0; k < a.size(); ++k)
      seen.use.push_back(!a.unseen[k] && std::ranges::none_of(map[j].sensors, [&](const auto& sensor) {
        return std::isnan(reading[std::stoul(sensor)][k]);
      }));
    size = std::min(size, a.size());
  }
  // Columns of one file may end at other times: what all of them reach counts.
  for (std::size_t i = 0; i < reading.size(); ++i) {
    reading[i].resize(size);
    out.reading.push_back(held_over(reading[i], model.inputs[i]));
  }
  for (auto& one : out.joints) {
    one.angle_deg.resize(size);
    one.use.resize(size);
  }
  return out;
}

// The glove's log of a pair that cannot be put on one clock says nothing either: it was given for the camera.
std::optional<Clock> add_pair(const RecalibrationFiles& files, const recording::TimeOptions& time,
                              const recording::Recording& log, RecalibrationRequest& request,
                              std::vector<std::string>& notes) {
  std::optional<Clock> clock;
  try {
    const std::vector<JointMap> map = map_of(files, request.model);
    HandRecordings take = read_take(files, time, log, map, request.model, notes);
    std::vector<std::string> unused;
    clock = clock_of(map, {}, take, unused);
    refuse_swapped(map, take, clock->offset_s);
    if (clock->confidence < recording::kUnsure)
      throw io::JobError(
          fmt::format("{}: its clock is not told by what moved (confidence {:.2f}): it does not count",
                      files.pair_camera.string(), clock->confidence));
    request.seen = seen_in(map, take, log, clock->offset_s, request.model);
    request.motion.push_back(motion_in(log, request.model));
  } catch (const io::JobError& error) {
    request.lacking.emplace_back(
        "glove and camera of one motion once more: twenty seconds in which the joints that the camera sees "
        "bend, not evenly");
    notes.emplace_back(error.what());
  }
  return clock;
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
  for (const std::string& pose : poses)
    if (pose != "open" && pose != "fist")
      throw io::InputError(fmt::format("unknown pose \"{}\"; known: open, fist", pose));
  if (std::ranges::none_of(model.inputs, [](const auto& input) { return input.poses.has_value(); }))
    throw io::InputError(fmt::format(
        "{}: the model does not say what its sensors read at the open hand and at the fist: identify it anew",
        log.source));
  std::vector<std::vector<double>> readings;
  std::vector<model::Spread> made;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    std::vector<double>& read = readings.emplace_back(sampled(log, model, i));
    made.push_back(input.poses ? spread_of(*input.poses) : model::Spread{{0, 1}, {0, 1}});
    if (input.poses && without_holes(read).size() * 2 >= read.size())
      read = held_over(read, input);
    else
      std::ranges::fill(read, std::numeric_limits<double>::quiet_NaN());  // it must not end a hold
  }
  Held out = poses_in(readings, model.sample_period_s, made, log.source);
  if (out.fist.empty() == (poses.size() > 1))
    throw io::JobError(fmt::format("{}: {} to be held, {} found", log.source, fmt::join(poses, " and "),
                                   out.fist.empty() ? "one pose is" : "two poses are"));
  if (poses.front() == "fist") std::swap(out.open, out.fist);
  return out;
}

Recalibration recalibrate_files(const RecalibrationFiles& files) {
  if (!files.map.empty() && files.pair_sensor.empty())
    throw io::InputError("--map names the columns of a camera's file: give --pair GLOVE CAMERA as well");
  RecalibrationRequest request;
  request.model = files.model;
  if (!files.prior.empty())
    request.prior = prior_from_json(io::read_document(files.prior), files.prior.string());
  std::vector<std::string> notes;
  std::vector<LogRanges> logs;
  const auto log_of = [&](const auto& path, const recording::TimeOptions& time) {
    recording::Recording log = read_log(path, files, time, request.model, notes);
    LogRanges& of = logs.emplace_back(LogRanges{log.source, {}, model::RangeCount(request.model)});
    for (const recording::Column& column : log.columns) of.columns.push_back(column.name);
    std::vector<double> row(log.columns.size());
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      for (std::size_t i = 0; i < row.size(); ++i) row[i] = log.columns[i].value[k];
      of.ranges.add(row);
    }
    return log;
  };
  if (!files.recording.empty())
    request.motion.push_back(motion_in(log_of(files.recording, files.time), request.model));
  if (!files.poses_log.empty()) {
    const recording::Recording log = log_of(files.poses_log, files.time);
    try {
      request.held = poses_in(files.poses, log, request.model);
    } catch (const io::JobError& error) {
      request.lacking.emplace_back("the poses once more: hold each for two seconds, and still");
      notes.emplace_back(error.what());
    }
  }
  std::optional<Clock> clock;
  if (!files.pair_sensor.empty()) {
    const auto time = recording::times_of_pair(files.pair_sensor, files.pair_camera, files.time);
    clock = add_pair(files, time, log_of(files.pair_sensor, time), request, notes);
  }
  Recalibration out = recalibrate(request);
  out.notes.insert(out.notes.begin(), notes.begin(), notes.end());
  out.clock = clock;
  out.logs = std::move(logs);
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
                       {"gain_is_told", s.gain_is_told},
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
