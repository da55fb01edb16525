#include <fmt/format.h>

#include <algorithm>

#include "host/identify/identify.hpp"
#include "host/identify/map_check.hpp"
#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {
namespace {

// Of each trial in the files.
std::vector<Take> read_trials(const PairFiles& files, const Options& options) {
  const recording::TimeOptions time =
      options.clock_offset_s ? options.time
                             : recording::times_of_pair(files.sensor, files.reference, options.time);
  std::vector<Take> out;
  const std::vector<std::string> sensors = sensors_of(options.map);
  const auto reader = recording::open_log(files.sensor, {sensors, time, recording::Holes::some});
  for (recording::Recording& trial : recording::read_segments(*reader, time)) {
    Take& one = out.emplace_back();
    one.sensor = std::move(trial);
    one.files = files;
    for (const std::string& sensor : sensors) {
      recording::state_unit(one.sensor, sensor, options.input_unit);
      recording::unwrap(one.sensor, sensor);
      recording::require_change(one.sensor, sensor, "is the sensor plugged in?");
    }
  }
  for (const JointMap& joint : options.map) {
    std::vector<recording::Recording> trials = recording::angle_segments(
        files.reference, joint.reference, recording::times_of_reference(files.sensor, files.reference, time));
    // Beside a clock that was reset the other one may have run on: its log goes with each trial.
    if (out.size() == 1) out.resize(trials.size(), Take(out.front()));
    if (trials.size() == 1) trials.resize(out.size(), recording::Recording(trials.front()));
    if (trials.size() != out.size())
      throw io::InputError("{} trials in {}, {} in {}: they must be as many", out.size(),
                           files.sensor.string(), trials.size(), files.reference.string());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].reference.push_back(std::move(trials[i]));
      recording::to_degrees(out[i].reference.back(), joint.reference, options.output_unit);
      recording::require_change(out[i].reference.back(), joint.reference, "does the camera see the marks?");
      const auto& angle = out[i].reference.back().column(joint.reference).value;
      if (const auto far =
              std::ranges::find_if(angle, [](double v) { return std::abs(v) > model::kMaxAngle_deg; });
          far != angle.end())
        throw io::InputError(
            "{}: column \"{}\" reads {:g} degrees: is it in another unit? Write it in degrees",
            files.reference.string(), joint.reference, *far);
    }
  }
  return out;
}

void add_warnings(const Take& take, std::vector<std::string>& warnings) {
  std::vector<std::string> all = take.sensor.warnings;
  for (const recording::Recording& r : take.reference)
    all.insert(all.end(), r.warnings.begin(), r.warnings.end());
  for (const std::string& warning : all)
    if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
}

}  // namespace

std::vector<Take> read_takes(const Request& request, std::vector<std::string>& warnings) {
  std::vector<Take> out;
  for (const PairFiles& pair : request.pairs) {
    for (Take& one : read_trials(pair, request)) {
      out.push_back(std::move(one));
      if (request.time.segments.empty()) refuse_seen_before(out);
      refuse_other_units(out);
      add_warnings(out.back(), warnings);
    }
  }
  return out;
}

Clock clock_of(const std::vector<JointMap>& map, std::optional<double> given, Take& take,
               std::vector<std::string>& warnings) {
  std::vector<recording::Witness> witnesses;
  const std::vector<std::string> sensors = sensors_of(map);
  std::vector<recording::Recording> readings;
  for (const std::string& sensor : sensors) readings.push_back(recording::without_holes(take.sensor, sensor));
  for (std::size_t j = 0; j < map.size(); ++j) {
    const std::string& first = map[j].sensors.front();
    const auto sensor = static_cast<std::size_t>(std::ranges::find(sensors, first) - sensors.begin());
    witnesses.push_back(
        {sensor, readings[sensor].series(first), &take.reference[j], map[j].reference, map[j].joint});
  }
  const bool known = share_a_clock(take.sensor, take.reference.front());
  if (!given && known) given = 0;
  std::vector<std::string> found;
  Clock clock = recording::find_clock(witnesses, given, known, found);
  bool is_left_out = false;
  for (const recording::Witness& w : witnesses)
    is_left_out |= recording::leave_out_frozen(*w.reference, w.column, w.reading, clock.offset_s, warnings);
  if (is_left_out) {  // whose warnings are of another pair
    found.clear();
    const double taken_out_ppm = clock.drift_ppm;
    clock = recording::find_clock(witnesses, given, known, found);
    clock.drift_ppm += taken_out_ppm;
  }
  if (known) clock.confidence = 1;
  for (const std::string& warning : found)
    warnings.push_back(fmt::format("{}: {}", take.sensor.source, warning));
  return clock;
}

std::vector<std::string> names_of(const std::vector<PairFiles>& takes) {
  std::vector<std::filesystem::path> logs;
  for (const PairFiles& take : takes) logs.push_back(take.sensor);
  return short_names(logs);
}

}  // namespace flexor::identify
