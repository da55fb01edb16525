#include "host/donning/recalibrate_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <fstream>
#include <limits>
#include <numbers>

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
                    "{:.3g} {}: is it in "
                    "another unit? Log what the model takes",
                    log.source, log.columns[i].name, range.min, range.max, input.name,
                    input.readings->reading.front(), input.readings->reading.back(), input.unit));
  }
}

// A log through the clock repair that apply has, a reset of the board included.
recording::Recording read_log(const std::filesystem::path& path, const FileRequest& request,
                              const model::Model& model, std::vector<std::string>& notes) {
  io::require_readable(path);
  std::ifstream file(path, std::ios::binary);
  recording::CsvReader reader(file, path.string(),
                              {model::columns_of(model, request.inputs), request.time_unit, true});
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
  if (out.t_s.front() == out.t_s.back())
    throw io::InputError(
        fmt::format("{}: time does not increase: it is {:g} s in every row", out.source, out.t_s.front()));
  refuse_other_unit(out, model);
  for (const std::string& note : stream.notes()) notes.push_back(note);
  out.digest = reader.digest();
  return out;
}

// Counts between the converter's rails; of anything else what was read, without spikes.
recording::Range range_of(const model::Input& input, const std::vector<double>& values) {
  if (input.unit == "count") return {input.valid_min, input.valid_max};
  const std::vector<double> read = without_holes(values);
  if (read.empty()) return {1, 0};
  return recording::without_spikes(read);
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
using Angles = std::vector<std::pair<Columned, recording::Recording>>;

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
    const bool twice = std::ranges::any_of(out, [&](const Columned& before) {
      return before.first == static_cast<std::size_t>(joint - model.joints.begin()) ||
             before.second == one.substr(equal + 1);
    });
    if (twice) throw io::InputError(fmt::format("--map {}: {} names a joint or a column again", map, one));
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

constexpr double kSwapped = 0.3;  // of two joints' explained motion

// What a sensor read, without holes.
struct Known {
  Known(const recording::Recording& log, std::size_t sensor)
      : value(without_holes(log.columns[sensor].value)) {
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      if (!std::isnan(log.columns[sensor].value[k])) t_s.push_back(log.t_s[k]);
    }
  }
  recording::Series series() const { return {t_s, value}; }

  std::vector<double> t_s;
  std::vector<double> value;
};

// By all joints that the camera saw; a drift is taken out of the angles' times.
recording::Clock clock_of(const recording::Recording& log, const model::Model& model, Angles& angles) {
  if (!log.digest.empty() && log.digest == angles.front().second.digest)
    return {.confidence = 1};  // one file
  const model::Graph graph(model);
  std::deque<Known> known;  // whose readings the witnesses show
  std::vector<recording::Witness> witnesses;
  for (auto& [seen, angle] : angles) {
    for (const std::size_t sensor : graph.inputs[graph.joint[seen.first]]) {
      const Known& read = known.emplace_back(log, sensor);
      witnesses.push_back({sensor, read.series(), &angle, seen.second, seen.second});
    }
  }
  std::vector<std::string> said;
  return recording::find_clock(witnesses, {}, said);
}

// How much of the angles their joints' sensors explain on this clock, each by its best; every joint counts one.
double explained(const recording::Recording& log, const model::Model& model, const Angles& angles,
                 double clock_offset_s) {
  const model::Graph graph(model);
  double sum = 0;
  for (const auto& [seen, angle] : angles) {
    double most = 0;
    for (const std::size_t sensor : graph.inputs[graph.joint[seen.first]]) {
      const Known read(log, sensor);
      if (read.value.size() < 2) continue;
      most = std::max(most, recording::explained(read.series(), angle.series(seen.second), clock_offset_s));
    }
    sum += most;
  }
  return sum;
}

// Two joints whose angles fit better the other way round, on the clock that they have then.
void refuse_swapped(const recording::Recording& log, const model::Model& model, const Angles& angles,
                    double clock_offset_s) {
  const double as_given = explained(log, model, angles, clock_offset_s);
  for (std::size_t b = 0; b < angles.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      Angles swapped = angles;
      std::swap(swapped[a].first.first, swapped[b].first.first);
      double other = 0;
      try {
        other = explained(log, model, swapped, clock_of(log, model, swapped).offset_s);
      } catch (const io::JobError&) {
        continue;
      }
      if (other < as_given + kSwapped) continue;
      const auto joint = [&](std::size_t i) { return model.joints[angles[i].first.first].name; };
      throw io::InputError(
          fmt::format("{}: \"{}\" moves as {} does and \"{}\" as {}: swap the two, with --map {}={},{}={}",
                      angles[a].second.source, angles[a].first.second, joint(b), angles[b].first.second,
                      joint(a), joint(a), angles[b].first.second, joint(b), angles[a].first.second));
    }
  }
}

// A hole is what was read before it; what comes of it does not count.
recording::Recording filled(recording::Recording log, const model::Model& model) {
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    std::vector<double>& values = log.columns[i].value;
    const auto first = std::ranges::find_if(values, [](double v) { return !std::isnan(v); });
    double last = first == values.end() ? model.inputs[i].valid_min : *first;
    for (double& v : values) last = v = std::isnan(v) ? last : v;
    log.columns[i].unit = model.inputs[i].unit;
    log.columns[i].name = fmt::format("{}", i);  // two inputs may have one column
  }
  return log;
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

Angles angles_of(const FileRequest& request, const model::Model& model, std::vector<std::string>& notes) {
  Angles out;
  for (const Columned& one : request.map.empty() ? by_name(request, model) : mapped(request.map, model)) {
    recording::Recording angle = recording::read_angle(request.pair_camera, one.second, request.time_unit);
    refuse_radians(angle, one.second);
    recording::to_degrees(angle, one.second, {});
    notes.insert(notes.end(), angle.warnings.begin(), angle.warnings.end());
    out.emplace_back(one, std::move(angle));
  }
  return out;
}

Seen seen_in(const recording::Recording& log, const Angles& angles, double clock_offset_s,
             const model::Model& model) {
  const Sampled known = sampled(log, model);
  const recording::Recording whole = filled(log, model);
  const model::Graph graph(model);
  Seen out;
  for (const auto& [columned, angle] : angles) {
    Seen::Angles& seen = out.joints.emplace_back();
    seen.joint = columned.first;
    const auto& own = graph.inputs[graph.joint[seen.joint]];
    for (std::size_t i = 0; i < model.inputs.size(); ++i) {
      recording::Aligned a;
      recording::sample_pair({whole, whole.columns[i].name, angle, columned.second},
                             1 / model.sample_period_s, clock_offset_s, 0, 1, a);
      if (i == 0) seen.angle_deg = a.angle_deg;
      if (i == 0) seen.use.assign(a.size(), 1);
      const bool is_own = std::ranges::find(own, i) != own.end();
      for (std::size_t k = 0; k < seen.use.size(); ++k)
        seen.use[k] &= !a.gap[k] && (!is_own || (k < known.good[i].size() && known.good[i][k]));
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

void lacks(Request& request, std::vector<std::string>& notes, const std::string& wanted,
           const std::string& why) {
  request.lacking.push_back(wanted);
  notes.push_back(why);
}

void add_poses(const FileRequest& files, Request& request, std::vector<std::string>& notes) {
  const recording::Recording log = read_log(files.poses_log, files, request.model, notes);
  try {
    request.holds = poses_in(files.poses, log, request.model);
  } catch (const io::JobError& error) {
    lacks(request, notes, "the poses once more: hold each for two seconds, and still", error.what());
  }
}

// The glove's log of a pair that cannot be put on one clock says nothing either: it was given for the camera.
std::optional<recording::Clock> add_pair(const FileRequest& files, Request& request,
                                         std::vector<std::string>& notes) {
  const recording::Recording log = read_log(files.pair_sensor, files, request.model, notes);
  const std::string wanted =
      "glove and camera of one motion once more: twenty seconds in which the joints that the camera sees "
      "bend, "
      "not evenly";
  try {
    Angles angles = angles_of(files, request.model, notes);
    const recording::Clock clock = clock_of(log, request.model, angles);
    refuse_swapped(log, request.model, angles, clock.offset_s);
    if (clock.confidence < recording::kUnsure) {
      lacks(request, notes, wanted,
            fmt::format("{}: its clock is not told by what moved (confidence {:.2f}): it does not count",
                        files.pair_camera.string(), clock.confidence));
      return clock;
    }
    request.seen = seen_in(log, angles, clock.offset_s, request.model);
    request.motion.push_back(motion_in(log, request.model));
    return clock;
  } catch (const io::JobError& error) {
    lacks(request, notes, wanted, error.what());
  }
  return {};
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

namespace {

// In place of a reading that is not good, the one before.
std::vector<double> held_over(std::vector<double> readings, const std::vector<std::uint8_t>& good) {
  const auto first = std::ranges::find(good, 1);
  double last = readings[static_cast<std::size_t>(first - good.begin())];
  for (std::size_t k = 0; k < readings.size(); ++k) last = readings[k] = good[k] ? readings[k] : last;
  return readings;
}

}  // namespace

std::vector<Hold> poses_in(const std::vector<std::string>& poses, const recording::Recording& log,
                           const model::Model& model) {
  std::vector<bool> fist;
  for (const std::string& pose : poses) {
    if (pose != "open" && pose != "fist")
      throw io::InputError(fmt::format("unknown pose \"{}\"; known: open, fist", pose));
    fist.push_back(pose == "fist");
  }
  const Sampled all = sampled(log, model);
  Columns moving;
  std::vector<model::Spread> made;
  std::vector<std::size_t> live;  // a sensor that reads nothing must not end a hold
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    if (!input.poses || std::ranges::count(all.good[i], 1) * 2 < std::ssize(all.good[i])) continue;
    made.push_back(spread_of(*input.poses));
    moving.push_back(held_over(all.reading[i], all.good[i]));
    live.push_back(i);
  }
  if (std::ranges::none_of(model.inputs, [](const auto& input) { return input.poses.has_value(); }))
    throw io::InputError(fmt::format(
        "{}: the model does not say what its sensors read at the open hand and at the fist: identify it anew",
        log.source));
  const std::vector<Hold> found =
      moving.empty() ? std::vector<Hold>{} : holds_in(moving, model.sample_period_s, made, fist);
  if (found.empty()) {
    throw io::JobError(fmt::format(
        "{}: {} were to be held, each for a second or more, and are not found: hold still, 2 s each",
        log.source, fmt::join(poses, " and ")));
  }
  std::vector<Hold> holds;
  for (const Hold& one : found) {
    Hold& hold = holds.emplace_back(
        Hold{one.fist, std::vector<double>(model.inputs.size(), std::numeric_limits<double>::quiet_NaN())});
    for (std::size_t k = 0; k < live.size(); ++k) hold.reading[live[k]] = one.reading[k];
  }
  return holds;
}

Recalibration recalibrate_files(const FileRequest& files) {
  if (!files.map.empty() && files.pair_sensor.empty())
    throw io::InputError("--map names the columns of a camera's file: give --pair GLOVE CAMERA as well");
  Request request;
  request.model = model::load(files.model);
  if (!files.prior.empty()) request.prior = load_prior(files.prior);
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
  for (const SensorResult& s : r.sensors) {
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
  for (const JointResult& joint : r.joints) {
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

}  // namespace flexor::donning
