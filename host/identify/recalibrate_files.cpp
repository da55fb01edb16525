#include "host/identify/recalibrate_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "host/identify/pose_evidence.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/resample.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kSwapped = 0.3;  // of two joints' explained motion

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

std::vector<double> without_holes(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  return values;
}

// Volts where counts are read, or the like: nobody's glove reads twenty times as much, or a twentieth, once it is put on anew.
void refuse_other_unit(const recording::Recording& log, const model::Model& model) {
  constexpr double kTimes = 20;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    const std::vector<double> read = without_holes(log.columns[i].value);
    if (!input.readings || read.empty()) continue;
    const recording::Range range = recording::without_spikes(read);
    const bool whole = std::ranges::all_of(read, [](double u) { return u == std::floor(u); });
    if (!(range.max > range.min) || (whole && input.unit == "count")) continue;
    const double now = std::max(std::abs(range.min), std::abs(range.max));
    const double made =
        std::max(std::abs(input.readings->reading.front()), std::abs(input.readings->reading.back()));
    if (now * kTimes > made && now < kTimes * made) continue;
    throw io::InputError(
        fmt::format("{}: column \"{}\" reads {:.3g} to {:.3g}, where the model was made {} read {:.3g} to "
                    "{:.3g} {}: is it in another unit? Log what the model takes",
                    log.source, log.columns[i].name, range.min, range.max, input.name,
                    input.readings->reading.front(), input.readings->reading.back(), input.unit));
  }
}

// A log through the clock repair that apply has, a reset of the board included.
recording::Recording read_log(const std::filesystem::path& path, const RecalibrationFiles& request,
                              const model::Model& model, std::vector<std::string>& notes) {
  recording::CsvReader reader(path, {model::columns_of(model, request.inputs), request.time, true});
  check_units(reader, model, notes);
  recording::Recording out = recording::read_rows(reader, recording::Resets::follow);
  if (out.t_s.size() < 2)
    throw io::InputError(fmt::format("{}: no two rows with a reading of every input", out.source));
  if (out.t_s.front() == out.t_s.back())
    throw io::InputError(
        fmt::format("{}: time does not increase: it is {:g} s in every row", out.source, out.t_s.front()));
  refuse_other_unit(out, model);
  notes.insert(notes.end(), out.warnings.begin(), out.warnings.end());
  return out;
}

// Counts between the converter's rails; of anything else what was read, without spikes.
recording::Range range_of(const model::Input& input, const std::vector<double>& values) {
  if (input.unit == "count") return {input.valid_min, input.valid_max};
  const std::vector<double> read = without_holes(values);
  if (read.empty()) return {1, 0};
  return recording::without_spikes(read);
}

// One sensor on the model's grid; NaN where nothing good was read.
std::vector<double> sampled(const recording::Recording& log, const model::Model& model, std::size_t sensor) {
  const double gap_s = std::max(model.max_gap_s, recording::default_max_gap_s(log.t_s));
  const std::vector<double>& values = log.columns[sensor].value;
  const recording::Range range = range_of(model.inputs[sensor], values);
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

// A joint and what the camera saw of it.
struct Measured {
  std::size_t joint = 0;
  std::string column;
  recording::Recording angle = {};
};

std::vector<Measured> mapped(const std::string& map, const model::Model& model) {
  std::vector<Measured> out;
  std::istringstream list(map);
  for (std::string one; std::getline(list, one, ',');) {
    const std::size_t equal = one.find('=');
    if (equal == std::string::npos || equal + 1 == one.size())
      throw io::InputError(fmt::format("--map {}: joint=column,joint=column", map));
    const std::string name = model::joint_name(one.substr(0, equal));
    const auto found = std::ranges::find(model.joints, name, &model::Joint::name);
    if (found == model.joints.end())
      throw io::InputError(fmt::format("--map: the model has no joint {}", name));
    const auto joint = static_cast<std::size_t>(found - model.joints.begin());
    const std::string column = one.substr(equal + 1);
    if (std::ranges::any_of(out, [&](const auto& m) { return m.joint == joint || m.column == column; }))
      throw io::InputError(fmt::format("--map {}: {} names a joint or a column again", map, one));
    out.push_back({joint, column});
  }
  return out;
}

std::vector<Measured> by_name(const RecalibrationFiles& request, const model::Model& model) {
  const auto columns = recording::columns_of(request.pair_camera, request.time);
  const std::string first = model.joints.front().name;
  std::vector<Measured> out;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const auto column = std::ranges::find_if(columns, [&](const std::string& c) {
      return c == model.joints[j].name || recording::cut_name(c).name == model.joints[j].name;
    });
    if (column != columns.end()) out.push_back({j, *column});
  }
  if (out.empty() && model.joints.size() == 1) {
    const auto column = columns.size() == 1
                            ? columns.begin()
                            : std::ranges::find(columns, model.training.value("output_column", first));
    if (column != columns.end()) out.push_back({0, *column});
  }
  if (out.empty()) {
    throw io::InputError(
        fmt::format("{}: no column is called like a joint of the model: --map {}=COLUMN; it has {}",
                    request.pair_camera.string(), first, fmt::join(columns, ", ")));
  }
  return out;
}

// What a sensor read, without holes.
struct Known {
  std::vector<double> t_s;
  std::vector<double> value;
  recording::Series series() const { return {t_s, value}; }
};

std::vector<Known> known_of(const recording::Recording& log) {
  std::vector<Known> out;
  for (const recording::Column& column : log.columns) {
    Known& one = out.emplace_back(Known{{}, without_holes(column.value)});
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      if (!std::isnan(column.value[k])) one.t_s.push_back(log.t_s[k]);
    }
  }
  return out;
}

// A glove's log and what a camera saw meanwhile.
struct Both {
  recording::Recording log;
  std::vector<Known> known;
  model::Graph graph;
  std::vector<Measured> measured;

  const std::vector<std::size_t>& sensors(const Measured& of) const {
    return graph.inputs[graph.joint[of.joint]];
  }
};

// By all joints that the camera saw; a drift is taken out of the angles' times.
recording::Clock clock_of(Both& both) {
  if (!both.log.digest.empty() && both.log.digest == both.measured.front().angle.digest)
    return {.confidence = 1};  // one file
  std::vector<recording::Witness> witnesses;
  for (Measured& one : both.measured) {
    for (const std::size_t sensor : both.sensors(one))
      witnesses.push_back({sensor, both.known[sensor].series(), &one.angle, one.column, one.column});
  }
  std::vector<std::string> said;
  return recording::find_clock(witnesses, {}, said);
}

// How much of the angles their joints' sensors explain on this clock, each by its best; every joint counts one.
double explained(const Both& both, double clock_offset_s) {
  double sum = 0;
  for (const Measured& one : both.measured) {
    double most = 0;
    for (const std::size_t sensor : both.sensors(one)) {
      const recording::Series read = both.known[sensor].series();
      if (read.value.size() < 2) continue;
      most = std::max(most, recording::explained(read, one.angle.series(one.column), clock_offset_s));
    }
    sum += most;
  }
  return sum;
}

// Two joints whose angles fit better the other way round, on the clock that they have then.
void refuse_swapped(const Both& both, const model::Model& model, double clock_offset_s) {
  const double as_given = explained(both, clock_offset_s);
  for (std::size_t b = 0; b < both.measured.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      Both swapped = both;
      std::swap(swapped.measured[a].joint, swapped.measured[b].joint);
      try {
        if (explained(swapped, clock_of(swapped).offset_s) < as_given + kSwapped) continue;
      } catch (const io::JobError&) {
        continue;
      }
      const Measured& one = both.measured[a];
      const Measured& other = both.measured[b];
      const std::string& own = model.joints[one.joint].name;
      const std::string& its = model.joints[other.joint].name;
      throw io::InputError(fmt::format(
          "{}: \"{}\" moves as {} does and \"{}\" as {}: swap the two, with --map {}={},{}={}",
          one.angle.source, one.column, its, other.column, own, own, other.column, its, one.column));
    }
  }
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

std::vector<Measured> measured_in(const RecalibrationFiles& request, const model::Model& model,
                                  std::vector<std::string>& notes) {
  std::vector<Measured> out = request.map.empty() ? by_name(request, model) : mapped(request.map, model);
  for (Measured& one : out) {
    one.angle = recording::read_angle(request.pair_camera, one.column, request.time);
    refuse_radians(one.angle, one.column);
    recording::to_degrees(one.angle, one.column, {});
    notes.insert(notes.end(), one.angle.warnings.begin(), one.angle.warnings.end());
  }
  return out;
}

// What comes of a hole, which is held over, does not count.
Seen seen_in(const Both& both, double clock_offset_s, const model::Model& model) {
  recording::Recording whole = both.log;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    // By its number: two inputs may have one column.
    whole.columns[i] = {std::to_string(i), held_over(whole.columns[i].value, input), input.unit};
  }
  Seen out;
  for (const Measured& one : both.measured) {
    Seen::Angles& seen = out.joints.emplace_back();
    seen.joint = one.joint;
    out.reading.clear();
    for (std::size_t i = 0; i < model.inputs.size(); ++i) {
      recording::Aligned a;
      recording::sample_pair({whole, whole.columns[i].name, one.angle, one.column}, 1 / model.sample_period_s,
                             clock_offset_s, 0, 1, a);
      seen.use.resize(a.size(), 1);
      for (std::size_t k = 0; k < a.size(); ++k) seen.use[k] &= !a.gap[k];
      seen.angle_deg = std::move(a.angle_deg);
      out.reading.push_back(std::move(a.input));
    }
    for (const std::size_t sensor : both.sensors(one)) {
      const std::vector<double> good = sampled(both.log, model, sensor);
      for (std::size_t k = 0; k < seen.use.size(); ++k)
        seen.use[k] &= k < good.size() && !std::isnan(good[k]);
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

void lacks(RecalibrationRequest& request, std::vector<std::string>& notes, const std::string& wanted,
           const std::string& why) {
  request.lacking.push_back(wanted);
  notes.push_back(why);
}

void add_poses(const RecalibrationFiles& files, RecalibrationRequest& request,
               std::vector<std::string>& notes) {
  const recording::Recording log = read_log(files.poses_log, files, request.model, notes);
  try {
    request.holds = poses_in(files.poses, log, request.model);
  } catch (const io::JobError& error) {
    lacks(request, notes, "the poses once more: hold each for two seconds, and still", error.what());
  }
}

// The glove's log of a pair that cannot be put on one clock says nothing either: it was given for the camera.
std::optional<recording::Clock> add_pair(const RecalibrationFiles& files, RecalibrationRequest& request,
                                         std::vector<std::string>& notes) {
  Both both{read_log(files.pair_sensor, files, request.model, notes), {}, model::Graph(request.model), {}};
  both.known = known_of(both.log);
  const std::string wanted =
      "glove and camera of one motion once more: twenty seconds in which the joints that the camera sees "
      "bend, not evenly";
  try {
    both.measured = measured_in(files, request.model, notes);
    const recording::Clock clock = clock_of(both);
    refuse_swapped(both, request.model, clock.offset_s);
    if (clock.confidence < recording::kUnsure) {
      lacks(request, notes, wanted,
            fmt::format("{}: its clock is not told by what moved (confidence {:.2f}): it does not count",
                        files.pair_camera.string(), clock.confidence));
      return clock;
    }
    request.seen = seen_in(both, clock.offset_s, request.model);
    request.motion.push_back(motion_in(both.log, request.model));
    return clock;
  } catch (const io::JobError& error) {
    lacks(request, notes, wanted, error.what());
  }
  return {};
}

}  // namespace

Motion motion_in(const recording::Recording& log, const model::Model& model) {
  Motion out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i)
    out.reading.push_back(without_holes(sampled(log, model, i)));
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
  std::vector<std::vector<double>> moving;
  std::vector<model::Spread> made;
  std::vector<std::size_t> live;  // a sensor that reads nothing must not end a hold
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    const std::vector<double> readings = sampled(log, model, i);
    if (!input.poses || without_holes(readings).size() * 2 < readings.size()) continue;
    made.push_back(spread_of(*input.poses));
    moving.push_back(held_over(readings, input));
    live.push_back(i);
  }
  if (std::ranges::none_of(model.inputs, [](const auto& input) { return input.poses.has_value(); }))
    throw io::InputError(fmt::format(
        "{}: the model does not say what its sensors read at the open hand and at the fist: identify it anew",
        log.source));
  std::vector<Hold> found =
      moving.empty() ? std::vector<Hold>{} : holds_in(moving, model.sample_period_s, made, fist);
  if (found.empty()) {
    throw io::JobError(fmt::format(
        "{}: {} were to be held, each for a second or more, and are not found: hold still, 2 s each",
        log.source, fmt::join(poses, " and ")));
  }
  for (Hold& hold : found) {
    std::vector<double> reading(model.inputs.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t k = 0; k < live.size(); ++k) reading[live[k]] = hold.reading[k];
    hold.reading = std::move(reading);
  }
  return found;
}

Recalibration recalibrate_files(const RecalibrationFiles& files) {
  if (!files.map.empty() && files.pair_sensor.empty())
    throw io::InputError("--map names the columns of a camera's file: give --pair GLOVE CAMERA as well");
  RecalibrationRequest request;
  request.model = model::load(files.model);
  if (!files.prior.empty())
    request.prior = prior_from_json(io::read_document(files.prior), files.prior.string());
  std::vector<std::string> notes;
  if (!files.recording.empty())
    request.motion.push_back(
        motion_in(read_log(files.recording, files, request.model, notes), request.model));
  if (!files.poses_log.empty()) add_poses(files, request, notes);
  std::optional<recording::Clock> clock;
  if (!files.pair_sensor.empty()) clock = add_pair(files, request, notes);
  Recalibration out = recalibrate(request);
  out.notes.insert(out.notes.begin(), notes.begin(), notes.end());
  out.clock = clock;
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
