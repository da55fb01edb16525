#include "host/identify/map_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "host/identify/hold.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/recording/align.hpp"
#include "host/recording/csv.hpp"
#include "host/recording/unit.hpp"

namespace flexor::identify {
namespace {

using io::InputError;

constexpr double kUnexplained = 0.2;  // of eta^2
constexpr double kMoreExplained = 0.1;
constexpr double kRelated = 0.7;   // correlation above which a slope means something
constexpr double kAlike = 2.5;     // slopes of one glove's recordings, at most so far apart
constexpr double kSame = 0.9995;   // correlation of sensors that say the same
constexpr double kStands = 0.05;   // share of the samples at an extreme
constexpr double kMovesOn = 0.25;  // of the other signal's range meanwhile

// Names alike but for digits, or for what stands before the last underscore: SensorA0 and SensorA1, thumb_adc and index_adc.
bool of_one_kind(const std::string& a, const std::string& b) {
  const auto kind = [](std::string name) {
    std::erase_if(name, [](unsigned char c) { return std::isdigit(c) != 0; });
    return name.substr(name.rfind('_') == std::string::npos ? 0 : name.rfind('_'));
  };
  return kind(a) == kind(b);
}

// All columns of the log; those of the map alone where another one holds what is no number.
recording::Recording every_column(const Take& take, const Options& options) {
  // A pipe is read once.
  const bool is_there = take.files.sensor.memory() || std::filesystem::is_regular_file(take.files.sensor);
  if (!is_there || !options.time.segments.empty()) return take.sensor;
  try {
    recording::TimeOptions time = options.time;
    if (take.sensor.time_column == recording::kHostClock) time.columns = {recording::kHostClock};
    return recording::read(*recording::open_log(take.files.sensor, {{}, time, recording::Holes::some}));
  } catch (const InputError&) {
    return take.sensor;
  }
}

struct Relation {
  double slope = 0;  // of y on x
  double correlation = 0;
};

Relation relation(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.empty()) return {};
  const auto off_mean = [](const std::vector<double>& values) -> Eigen::VectorXd {
    const Eigen::Map<const Eigen::ArrayXd> all(values.data(), std::ssize(values));
    return all - all.mean();
  };
  const Eigen::VectorXd dx = off_mean(x);
  const Eigen::VectorXd dy = off_mean(y);
  const double xx = dx.squaredNorm();
  const double xy = dx.dot(dy);
  const double yy = dy.squaredNorm();
  if (!(xx > 0 && yy > 0)) return {};
  return {xy / xx, xy / std::sqrt(xx * yy)};
}

// Where one stands at its least or largest value while the other moves on: "stands at 40 ... goes from 20 to 70".
std::optional<std::string> clipped(const std::vector<double>& seen, const std::vector<double>& other) {
  if (seen.empty()) return std::nullopt;
  const auto range = [](std::vector<double> values) {
    std::ranges::sort(values);
    return std::pair(quantile(values, 0.05), quantile(values, 0.95));
  };
  const auto [low, high] = range(other);
  for (const double extreme : {std::ranges::min(seen), std::ranges::max(seen)}) {
    std::vector<double> meanwhile;
    for (std::size_t k = 0; k < seen.size(); ++k)
      if (seen[k] == extreme) meanwhile.push_back(other[k]);
    if (static_cast<double>(meanwhile.size()) < kStands * static_cast<double>(seen.size())) continue;
    const auto [from, to] = range(meanwhile);
    if (to - from >= kMovesOn * (high - low))
      return fmt::format(
          "stands at {:g} for {:.0f} % of the time while the other goes from {:.4g} to {:.4g}", extreme,
          100.0 * static_cast<double>(meanwhile.size()) / static_cast<double>(seen.size()), from, to);
  }
  return std::nullopt;
}

constexpr double kRange_deg = 20;
constexpr double kSpan_s = 0.25;  // over which a speed is taken
constexpr double kQuick_deg_s = 60;
constexpr double kSlow_deg_s = 30;
constexpr double kStill_deg_s = 3;
constexpr double kSlow_s = 0.5;

}  // namespace

void warn_of_equal_columns(const std::vector<JointMap>& map, const recording::Recording& log,
                           std::vector<std::string>& warnings) {
  std::set<std::string> before;
  for (const JointMap& joint : map) {
    for (const std::string& sensor : joint.sensors) {
      for (const std::string& other : before) {
        const double alike = relation(log.column(other).value, log.column(sensor).value).correlation;
        if (other == sensor || std::abs(alike) <= kSame) continue;
        warnings.push_back(
            fmt::format("{} and {} say the same: are they two columns of one sensor? Of one joint leave one "
                        "of them out of the map",
                        other, sensor));
      }
      before.insert(sensor);
    }
  }
}

std::set<std::string> check_map(const Options& options, const Take& take, double clock_offset_s,
                                std::vector<std::string>& warnings) {
  std::set<std::string> stuck;
  warn_of_equal_columns(options.map, take.sensor, warnings);
  const bool clock_is_known = options.clock_offset_s || share_a_clock(take.sensor, take.reference.front());
  const recording::Recording all = every_column(take, options);
  for (std::size_t j = 0; j < options.map.size(); ++j) {
    const JointMap& map = options.map[j];
    const std::string& own = map.sensors.front();
    const recording::Series angle = take.reference[j].series(map.reference);
    const recording::Recording alone = recording::without_holes(take.sensor, own);
    if (const auto still = recording::frozen(alone.series(own), angle, clock_offset_s)) {
      warnings.push_back(fmt::format("{}: {} {} while the angle moves: is it stuck or unplugged?", map.joint,
                                     own, recording::in_words(*still)));
      stuck.insert(map.joint);
      continue;  // nothing else is known of the map
    }
    const double share = recording::explained(alone.series(own), angle, clock_offset_s);
    std::string best = own;
    double most = share;
    for (const recording::Column& column : all.columns) {
      if (column.name == own || !of_one_kind(column.name, own)) continue;
      const double other = recording::explained(
          recording::without_holes(all, column.name).series(column.name), angle, clock_offset_s);
      if (other > most) {
        most = other;
        best = column.name;
      }
    }
    if (most < kUnexplained && map.sensors.size() == 1) {
      const std::string text = fmt::format("{}: no sensor explains \"{}\": {} explains most of it, {:.0f} %",
                                           map.joint, map.reference, best, 100 * most);
      if (!clock_is_known) throw io::JobError(text);
      warnings.push_back(text + ", its past readings aside");
    }
    if (most > share + kMoreExplained) {
      warnings.push_back(
          fmt::format("{}: {} explains {:.0f} % of \"{}\", {} of the map {:.0f} %: is the map right?",
                      map.joint, best, 100 * most, map.reference, own, 100 * share));
    }
  }
  return stuck;
}

void refuse_seen_before(const std::vector<Take>& takes) {
  const Take& last = takes.back();
  for (std::size_t p = 0; p + 1 < takes.size(); ++p) {
    if (last.sensor.digest.empty() || takes[p].sensor.digest != last.sensor.digest) continue;
    throw InputError("{}: the same log as {} of another pair, and no second recording: give it once",
                     last.sensor.source, takes[p].sensor.source);
  }
}

void refuse_other_units(const std::vector<Take>& takes) {
  const recording::Recording& first = takes.front().sensor;
  const recording::Recording& last = takes.back().sensor;
  const auto range = [](const recording::Recording& log, const std::string& name) {
    return recording::without_spikes(recording::without_holes(log, name).columns.front().value);
  };
  for (const recording::Column& column : last.columns) {
    const recording::Column& before = first.column(column.name);
    const recording::Range now = range(last, column.name);
    const recording::Range then = range(first, column.name);
    const double ratio = (std::abs(now.max) + std::abs(now.min)) / (std::abs(then.max) + std::abs(then.min));
    const bool is_apart = now.min > then.max || now.max < then.min;
    if (column.unit == before.unit && !(is_apart && (ratio > kAlike || ratio < 1 / kAlike))) continue;
    throw InputError(
        "{}: column \"{}\" reads {:.4g} to {:.4g}{}, in {} {:.4g} to {:.4g}{}: is it in another unit? Fit "
        "each on its own",
        last.source, column.name, now.min, now.max, column.unit.empty() ? "" : " " + column.unit,
        first.source, then.min, then.max, before.unit.empty() ? "" : " " + before.unit);
  }
}

void check_gloves(const JointMap& map, const std::vector<std::string>& names,
                  const std::vector<Session>& sessions) {
  std::optional<std::pair<std::size_t, double>> first;
  for (std::size_t p = 0; p < sessions.size(); ++p) {
    const Relation own = relation(used_angles({&sessions[p], 1}), used_readings({&sessions[p], 1}, 0));
    if (std::abs(own.correlation) < kRelated) continue;
    if (!first) {
      first = {p, own.slope};
      continue;
    }
    const double ratio = own.slope / first->second;
    if (ratio > 1 / kAlike && ratio < kAlike) continue;
    throw InputError(
        "{}: in {} {} moves {:.2g} times as far with the angle as in {}: are these of one glove? "
        "Fit each on its own",
        map.joint, names[p], map.sensors.front(), ratio, names[first->first]);
  }
}

std::optional<std::string> unit_note(const model::Input& input, const std::string& file,
                                     const std::string& column, const std::string& unit) {
  const std::string& wanted = input.unit;
  if (unit == wanted) return std::nullopt;
  if (!unit.empty() && recording::known_unit(wanted))
    throw InputError("{}: column \"{}\" is in {}, the model's input {} takes {}", file, column, unit,
                     input.name, wanted);
  return fmt::format("{}: column \"{}\" {}, the model's input {} {}: taken as the same", file, column,
                     unit.empty() ? "states no unit" : "is in " + unit, input.name,
                     wanted.empty() ? "states none" : "takes " + wanted);
}

std::vector<std::string> one_sided(const JointMap& map, const std::vector<Session>& sessions) {
  std::vector<std::string> out;
  const auto say = [&](const std::string& text) {
    if (std::ranges::find(out, text) == out.end()) out.push_back(text);
  };
  for (const Session& session : sessions) {
    const std::vector<double> readings = used_readings({&session, 1}, 0);
    const std::vector<double> angles = used_angles({&session, 1});
    if (const auto text = clipped(readings, angles))
      say(fmt::format("{} {}: is it clipped? Nothing tells the angle there", map.sensors.front(), *text));
    if (const auto text = clipped(angles, readings))
      say(fmt::format("\"{}\" {}: is it clipped? Nothing is learnt there, and the clock offset suffers",
                      map.reference, *text));
  }
  return out;
}

std::vector<std::string> lacking(const std::vector<Session>& sessions, double period_s) {
  const auto span = std::max<Eigen::Index>(1, std::lround(kSpan_s / period_s));
  bool is_held = false;
  bool is_slow = false;
  double quickest_deg_s = 0;
  for (const Session& session : sessions) {
    is_held = is_held || !holds_of(session, period_s).empty();
    Eigen::Index slow = 0;
    for (Eigen::Index k = span; k < session.angle_deg.size(); ++k) {
      const auto used = [&](Eigen::Index at) { return session.use[static_cast<std::size_t>(at)] != 0; };
      const double speed = std::abs(session.angle_deg(k) - session.angle_deg(k - span)) /
                           (static_cast<double>(span) * period_s);
      if (used(k) && used(k - span)) quickest_deg_s = std::max(quickest_deg_s, speed);
      slow = used(k) && speed > kStill_deg_s && speed < kSlow_deg_s ? slow + 1 : 0;
      is_slow = is_slow || static_cast<double>(slow) * period_s >= kSlow_s;
    }
  }
  std::vector<double> angles = used_angles(sessions);
  if (angles.empty()) return {};
  std::ranges::sort(angles);
  const double range = quantile(angles, 0.99) - quantile(angles, 0.01);
  std::vector<std::string> out;
  const auto say = [&](bool lacks, const std::string& what) {
    if (lacks) out.push_back(what + " (flexor protocol prints the recommended motion)");
  };
  say(range < kRange_deg,
      fmt::format("it moves by {:.0f} degrees only: go from the open hand to the fist and back", range));
  say(!is_held,
      "it is never held for a second: hold the hand open, half closed and closed, two seconds each");
  say(quickest_deg_s < std::min(kQuick_deg_s, range),
      "it never moves quickly: open and close within a second, some times");
  say(!is_slow, "it never moves slowly: take four seconds to close, and four to open");
  return out;
}

std::optional<std::string> refused_readings(const model::Input& input,
                                            const std::vector<std::span<const double>>& logs) {
  std::ptrdiff_t refused = 0;
  for (const std::span<const double> log : logs)
    refused +=
        std::ranges::count_if(log, [&](double u) { return u < input.valid_min || u > input.valid_max; });
  if (refused == 0) return std::nullopt;
  return fmt::format(
      "{}: {} reading(s) lie outside the valid range of {:g} to {:g} {}: was the sensor unplugged or "
      "shorted? They are left out, and where nothing else was read the compensator holds its angle",
      input.name, refused, input.valid_min, input.valid_max, input.unit);
}

}  // namespace flexor::identify
