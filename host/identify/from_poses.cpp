#include "host/identify/from_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/identify/joint_fit.hpp"
#include "host/identify/readings.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/model/correction.hpp"
#include "host/recording/line_format.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

constexpr double kOtherPose = 0.6;  // of the span, by which the poses differ
// Of the span, which readings may lie beyond the poses where the unit says nothing.
constexpr double kBeyondPoses = 0.5;
constexpr double kSameHold = 0.15;  // of the range, by which two holds of a pose may differ without a warning
constexpr double kOneHold = 0.35;   // and at all
constexpr double kRoom_deg = 20;    // beyond the poses
constexpr double kTrembles = 5;     // mean steps: of white noise 96 % lie within 3.6, of two poses far more
constexpr double kTrembles_counts = 6;

struct Sensor {
  model::Input input;  // named as its joint
  const std::vector<double>* value = nullptr;

  double span() const { return input.readings->span(); }
};

// The unit where the column states none: counts, if all readings may be a converter's.
bool may_be_counts(const std::vector<double>& readings) {
  return std::ranges::all_of(readings, [](double r) { return r >= 0 && r <= 65535 && r == std::floor(r); });
}

// One that is not connected would let no second count as rest.
bool only_trembles(const Sensor& s) {
  double steps = 0;
  for (std::size_t k = 1; k < s.value->size(); ++k) steps += std::abs((*s.value)[k] - (*s.value)[k - 1]);
  return s.span() <= kTrembles * steps / static_cast<double>(s.value->size() - 1) ||
         (s.input.unit == "count" && s.span() <= kTrembles_counts);
}

std::vector<Sensor> sensors_of(const recording::Recording& log, const std::vector<std::string>& joints,
                               std::vector<std::string>& left_out, std::vector<std::string>& warnings) {
  std::vector<Sensor> out;
  std::size_t columns = 0;
  std::string guessed;
  for (const recording::Column& column : log.columns) {
    if (column.name == "host_s") continue;
    const std::string joint =
        columns < joints.size() ? joints[columns] : model::joint_name(recording::cut_name(column.name).name);
    ++columns;
    if (joint == "-") continue;
    Sensor sensor{{joint, column.name, column.unit, {}}, &column.value};
    sensor.input.readings = spread_of(column.value, kSpreadShares);
    if (column.unit.empty() && may_be_counts(column.value)) {
      sensor.input.unit = "count";
      guessed += (guessed.empty() ? "" : ", ") + column.name;
    }
    if (only_trembles(sensor)) {
      left_out.push_back(column.name);
      warnings.push_back(fmt::format("{} hardly moves, by {:.5g} from {:.5g}: left out; is it connected?",
                                     column.name, sensor.span(), sensor.input.readings->reading.front()));
    } else {
      out.push_back(std::move(sensor));
    }
  }
  if (!joints.empty() && joints.size() != columns)
    throw io::InputError("--joints names {} joints, {} has {} columns: - leaves one out", joints.size(),
                         log.source, columns);
  if (!guessed.empty())
    warnings.push_back(fmt::format(
        "{}: whole numbers without a unit, taken for a converter's counts: --input-unit", guessed));
  if (out.empty())
    throw io::JobError(
        "{}: no sensor moves, or by no more than it trembles: one pose tells nothing; hold the "
        "open hand, then a fist, each for three seconds",
        log.source);
  const auto is_finger = [](const Sensor& s) {
    return std::ranges::count(model::finger_names(), s.input.name) > 0;
  };
  if (std::ranges::none_of(out, is_finger))
    warnings.push_back(
        fmt::format("no column is called as a finger: --joints thumb,index,... names the {} in their order, "
                    "for the board and VR",
                    columns));
  return out;
}

void check_angles(const std::map<std::string, model::Ends>& angles, const std::vector<Sensor>& sensors) {
  for (const auto& [joint, at] : angles) {
    const bool is_sensed =
        std::ranges::any_of(sensors, [&name = joint](const Sensor& s) { return s.input.name == name; });
    if (!is_sensed) throw io::InputError("--pose-angles {}: no column that moves is called so", joint);
    if (!(std::abs(at.fist_deg - at.open_deg) >= model::kLeastEnds_deg))
      throw io::InputError("--pose-angles {}: open hand and fist must be a degree apart or more", joint);
  }
}

void add_joint(model::Model& m, const Sensor& sensor, double open, double fist,
               const std::map<std::string, model::Ends>& angles) {
  const std::string& joint = sensor.input.name;
  const auto given = angles.find(joint);
  const model::Ends at = given != angles.end()        ? given->second
                         : joint.starts_with("thumb") ? kThumb
                                                      : kFinger;
  model::Input input = sensor.input;
  if (std::ranges::count(model::finger_names(), joint) > 0) input.strip = joint;
  const double span = std::abs(fist - open);
  if (input.unit != "count") {
    input.valid_min = std::min(open, fist) - kBeyondPoses * span;
    input.valid_max = std::max(open, fist) + kBeyondPoses * span;
  }
  const double gain = scale_to_counts(input);
  input.poses = model::Poses{gain * open, gain * fist};
  for (double& reading : input.readings->reading) reading *= gain;
  m.inputs.push_back(input);
  model::Curve line{{gain * open, gain * fist}, {at.open_deg, at.fist_deg}};
  if (fist < open) line = model::Curve{{gain * fist, gain * open}, {at.fist_deg, at.open_deg}};
  m.blocks.push_back({{joint}, joint + " line", line});
  const auto [least_deg, most_deg] = std::minmax(at.open_deg, at.fist_deg);
  m.blocks.push_back(
      {{joint + " line"}, joint + " angle", model::Saturation{least_deg - kRoom_deg, most_deg + kRoom_deg}});
  m.joints.push_back({joint, joint + " angle", at.open_deg,
                      model::Accuracy{{least_deg, most_deg}, {kPosesError_deg, kPosesError_deg}}, at});
  const std::size_t newest = m.inputs.size() - 1;  // in the call it may be asked for after the move
  if (gain != 1) m = model::corrected(std::move(m), newest, {gain, 0});
}

Held held_in(const recording::Recording& log, const std::vector<Sensor>& sensors) {
  std::vector<std::vector<double>> readings;
  std::vector<model::Spread> spans;
  for (const Sensor& s : sensors) {
    readings.push_back(*s.value);
    spans.push_back(*s.input.readings);
  }
  const double period_s = (log.t_s.back() - log.t_s.front()) / static_cast<double>(log.t_s.size() - 1);
  Held out = poses_in(readings, period_s, spans, log.source);
  if (out.fist.empty())
    throw io::JobError("{}: only one pose is held: begin with the open hand, then hold a fist", log.source);
  return out;
}

// Whether the sensor distinguishes the poses; reasons against it are warnings.
bool tells_apart(const Sensor& sensor, std::size_t i, const Held& held, std::vector<std::string>& warnings) {
  const double span = std::abs(median(readings_in(held.fist, i)) - median(readings_in(held.open, i)));
  if (span < kOtherPose * sensor.span()) {
    warnings.push_back(fmt::format("{} does not tell the two poses apart: left out", sensor.input.column));
    return false;
  }
  bool is_one = true;
  const bool counts = sensor.input.unit == "count";
  for (const auto& [pose, rests] : {std::pair("open hand", &held.open), std::pair("fist", &held.fist)}) {
    const auto [least, most] = std::ranges::minmax(readings_in(*rests, i));
    const double apart = (most - least) / span;
    if (counts && (least < sensor.input.valid_min || most > sensor.input.valid_max)) {
      warnings.push_back(fmt::format("{} jumps to its converter's end in the {}: left out; is it broken?",
                                     sensor.input.column, pose));
      return false;
    }
    is_one = is_one && apart <= kOneHold;
    if (apart <= kSameHold) continue;
    warnings.push_back(fmt::format("{}: the {} was held in ways that differ by {:.0f} % of the range{}",
                                   sensor.input.column, pose, 100 * apart,
                                   apart > kOneHold ? ": left out" : ""));
  }
  return is_one;
}

// Brings the open hand first.
void order(Held& held, FirstPose first, const std::vector<Sensor>& sensors,
           std::vector<std::string>& warnings) {
  std::vector<std::string> fall;
  for (std::size_t i = 0; i < sensors.size(); ++i)
    if (median(readings_in(held.fist, i)) < median(readings_in(held.open, i)))
      fall.push_back(sensors[i].input.column);
  if (first == FirstPose::unstated && !fall.empty()) {
    const bool all = fall.size() == sensors.size();
    warnings.push_back(
        fmt::format("{} from the first pose to the second, and sensors wired as flexor wiring says rise as "
                    "they bend: the first is taken for the {}; if it was the {}, add --first-pose {}",
                    all ? "all readings fall" : recording::listed(fall) + " fall, the others rise,",
                    all ? "fist" : "open hand", all ? "open hand" : "fist", all ? "open" : "fist"));
    if (all) first = FirstPose::fist;
  }
  if (first == FirstPose::fist) std::swap(held.open, held.fist);
}

}  // namespace

FromPoses model_from_poses(const recording::Recording& log, const PosesOptions& options) {
  FromPoses out;
  std::vector<std::string> left_out;
  std::vector<Sensor> sensors = sensors_of(log, options.joints, left_out, out.warnings);
  check_angles(options.angles, sensors);
  Held held = held_in(log, sensors);
  order(held, options.first, sensors, out.warnings);
  out.open_holds = static_cast<int>(held.open.size());
  out.fist_holds = static_cast<int>(held.fist.size());
  out.model.name = "from held poses";
  out.model.description =
      "A straight line from the open hand to a fist; the fist's angle is that of an ordinary hand, not "
      "measured.";
  out.model.written_by = "flexor " FLEXOR_VERSION;
  out.model.sample_period_s = 1 / options.rate_hz;
  double most = 0;  // of one converter
  for (const Sensor& sensor : sensors)
    most = std::max(most, sensor.input.unit == "count" ? std::ranges::max(*sensor.value) : 0);
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const recording::Range valid = recording::counts_that_tell(*sensors[i].value, recording::adc_top(most));
    sensors[i].input.valid_min = valid.min;  // of counts
    sensors[i].input.valid_max = valid.max;
    if (tells_apart(sensors[i], i, held, out.warnings)) {
      add_joint(out.model, sensors[i], median(readings_in(held.open, i)), median(readings_in(held.fist, i)),
                options.angles);
    } else {
      left_out.push_back(sensors[i].input.column);
    }
  }
  if (left_out.size() > out.model.joints.size())
    throw io::JobError(
        "{}: {} of {} sensors do not tell two poses apart ({}): is it a log of an open hand and "
        "a fist, each held for three seconds, and again? - in --joints leaves one out",
        log.source, left_out.size(), left_out.size() + out.model.joints.size(), recording::listed(left_out));
  model::check(out.model);
  return out;
}

}  // namespace flexor::identify
