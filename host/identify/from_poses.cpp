#include "host/identify/from_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "host/identify/poses.hpp"
#include "host/identify/robust.hpp"
#include "host/identify/window.hpp"
#include "host/io/io.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

constexpr double kSamePose = 0.3;   // of the span: the same pose
constexpr double kOtherPose = 0.6;  // and the other one
// Of the span, which readings may lie beyond the poses where the unit says nothing.
constexpr double kBeyondPoses = 0.5;
constexpr double kSameHold = 0.15;  // of the range, by which two holds of a pose may differ unsaid
constexpr double kRoom_deg = 20;    // beyond the poses
constexpr double kTrembles_counts = 6;

struct Sensor {
  std::string column;
  std::string name;
  std::string unit;
  const std::vector<double>* value = nullptr;
  std::vector<double> sorted;
  double span() const { return at(0.98) - at(0.02); }
  double at(double share) const {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
};

// One that is not connected would let no second count as rest.
bool only_trembles(const Sensor& s) { return s.unit == "count" && s.span() <= kTrembles_counts; }

std::vector<Sensor> sensors_of(const recording::Recording& log, std::vector<std::string>& warnings) {
  std::vector<Sensor> out;
  for (const recording::Column& column : log.columns) {
    if (column.name == "host_s") continue;
    Sensor sensor{column.name, recording::cut_name(column.name).name, column.unit, &column.value,
                  column.value};
    std::ranges::sort(sensor.sorted);
    if (sensor.sorted.empty() || !(sensor.span() > 0)) continue;
    if (only_trembles(sensor)) {
      warnings.push_back(fmt::format("{} hardly moves, by {:.0f} counts: left out; is its strip connected?",
                                     sensor.column, sensor.span()));
    } else {
      out.push_back(std::move(sensor));
    }
  }
  if (out.empty())
    throw io::JobError(fmt::format("{}: no sensor moves: open and close the hand", log.source));
  return out;
}

// Mean over the half of the sensors that moved most: one that does not follow says nothing.
double distance(const Rest& a, const Rest& b, const std::vector<Sensor>& sensors) {
  std::vector<double> away;
  for (std::size_t i = 0; i < sensors.size(); ++i)
    away.push_back(std::abs(a.reading[i] - b.reading[i]) / sensors[i].span());
  std::ranges::sort(away, std::greater());
  const std::size_t half = (away.size() + 1) / 2;
  double sum = 0;
  for (std::size_t i = 0; i < half; ++i) sum += away[i];
  return sum / static_cast<double>(half);
}

double median_of(const std::vector<Rest>& rests, std::size_t sensor) {
  std::vector<double> v;
  for (const Rest& rest : rests) v.push_back(rest.reading[sensor]);
  return median(std::move(v));
}

double scatter_of(const std::vector<Rest>& rests, std::size_t sensor) {
  const auto [least, most] =
      std::ranges::minmax(rests, {}, [sensor](const Rest& rest) { return rest.reading[sensor]; });
  return most.reading[sensor] - least.reading[sensor];
}

// Of a converter that reads as much: 1023, 4095 ...
double full_scale(double greatest) {
  double out = 1023;
  while (out < greatest) out = 2 * out + 1;
  return out;
}

void check_angles(const std::map<std::string, model::Ends>& angles, const std::vector<Sensor>& sensors) {
  for (const auto& [joint, at] : angles) {
    const bool is_sensed = std::ranges::any_of(
        sensors, [&name = joint](const Sensor& s) { return model::joint_name(s.name) == name; });
    if (!is_sensed)
      throw io::InputError(fmt::format("--pose-angles {}: no column that moves is called so", joint));
    if (!(std::abs(at.fist_deg - at.open_deg) >= model::kLeastEnds_deg))
      throw io::InputError(
          fmt::format("--pose-angles {}: open hand and fist must be a degree apart or more", joint));
  }
}

void add_joint(model::Model& m, const Sensor& sensor, double open, double fist,
               const std::map<std::string, model::Ends>& angles) {
  const std::string joint = model::joint_name(sensor.name);
  const auto told = angles.find(joint);
  const model::Ends at = told != angles.end() ? told->second : joint.starts_with("thumb") ? kThumb : kFinger;
  model::Input input;
  input.name = joint;
  input.column = sensor.column;
  input.unit = sensor.unit;
  if (std::ranges::find(model::finger_names(), joint) != model::finger_names().end()) input.strip = joint;
  const double span = std::abs(fist - open);
  const bool counts = sensor.unit == "count";
  input.valid_min = counts ? 1 : std::min(open, fist) - kBeyondPoses * span;
  input.valid_max =
      counts ? full_scale(sensor.sorted.back()) - 1 : std::max(open, fist) + kBeyondPoses * span;
  input.poses = model::Poses{open, fist};
  input.readings = spread_of(sensor.sorted, kSpreadShares);
  m.inputs.push_back(input);
  model::Curve line{{open, fist}, {at.open_deg, at.fist_deg}};
  if (fist < open) line = model::Curve{{fist, open}, {at.fist_deg, at.open_deg}};
  m.blocks.push_back({{joint}, joint + " line", line});
  const auto [least_deg, most_deg] = std::minmax(at.open_deg, at.fist_deg);
  m.blocks.push_back(
      {{joint + " line"}, joint + " angle", model::Saturation{least_deg - kRoom_deg, most_deg + kRoom_deg}});
  m.joints.push_back({joint, joint + " angle", at.open_deg,
                      model::Accuracy{{least_deg, most_deg}, {kPosesError_deg, kPosesError_deg}}, at});
}

}  // namespace

FromPoses model_from_poses(const recording::Recording& log, double rate_hz,
                           const std::map<std::string, model::Ends>& angles) {
  FromPoses out;
  const std::vector<Sensor> sensors = sensors_of(log, out.warnings);
  check_angles(angles, sensors);
  std::vector<std::vector<double>> readings;
  std::vector<model::Spread> spans;
  for (const Sensor& s : sensors) {
    readings.push_back(*s.value);
    spans.push_back({{0.02, 0.98}, {s.at(0.02), s.at(0.98)}});
  }
  const double period_s = (log.t_s.back() - log.t_s.front()) / static_cast<double>(log.t_s.size() - 1);
  const std::vector<Rest> rests = rests_in(readings, period_s, spans);
  if (rests.empty())
    throw io::JobError(fmt::format(
        "{}: no second in which all sensors rest: hold the open hand, then a fist, each for three "
        "seconds; a sensor that only trembles is to be unplugged",
        log.source));
  std::vector<Rest> open;
  std::vector<Rest> fist;
  for (const Rest& rest : rests) {
    const double away = distance(rest, rests.front(), sensors);
    if (away < kSamePose) open.push_back(rest);
    if (away > kOtherPose) fist.push_back(rest);
  }
  if (fist.empty())
    throw io::JobError(
        fmt::format("{}: only one pose is held: begin with the open hand, then hold a fist", log.source));
  out.open_holds = static_cast<int>(open.size());
  out.fist_holds = static_cast<int>(fist.size());
  out.model.name = "from held poses";
  out.model.description =
      "A straight line from the open hand to a fist; the fist's angle is that of an ordinary hand, not "
      "measured.";
  out.model.written_by = "flexor " FLEXOR_VERSION;
  out.model.sample_period_s = 1 / rate_hz;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const double from = median_of(open, i);
    const double to = median_of(fist, i);
    if (std::abs(to - from) < kOtherPose * sensors[i].span()) {
      out.warnings.push_back(fmt::format("{} tells the two poses not apart: left out", sensors[i].column));
      continue;
    }
    for (const auto& [pose, rests_of] : {std::pair("open hand", &open), std::pair("fist", &fist)}) {
      const double apart = scatter_of(*rests_of, i) / std::abs(to - from);
      if (apart > kSameHold)
        out.warnings.push_back(fmt::format("{}: the {} was held in ways that differ by {:.0f} % of the range",
                                           sensors[i].column, pose, 100 * apart));
    }
    add_joint(out.model, sensors[i], from, to, angles);
  }
  if (out.model.joints.empty())
    throw io::JobError(fmt::format("{}: no sensor tells the two poses apart", log.source));
  model::check(out.model);
  return out;
}

}  // namespace flexor::identify
