#include "host/identify/readings.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "host/identify/robust.hpp"
#include "host/io/io.hpp"
#include "host/model/compensator.hpp"
#include "host/model/tracking.hpp"
#include "host/recording/resample.hpp"

namespace flexor::identify {
namespace {

constexpr int kStillParts = 8;
constexpr double kStill_s = 1;
constexpr double kMedian_s = 0.5;
constexpr double kStillShare = 0.125;  // of the span: the range of what rests
constexpr double kApart = 0.3;         // of the span: rests that are nearer are of one pose

double quantile_of(std::span<const double> sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  if (i + 1 >= sorted.size()) return sorted.back();
  return sorted[i] + (at - static_cast<double>(i)) * (sorted[i + 1] - sorted[i]);
}

// In spans; mean over the half of the sensors that moved most: one that does not follow tells nothing.
double distance(const Rest& a, const Rest& b, const std::vector<model::Spread>& made) {
  std::vector<double> away;
  for (std::size_t i = 0; i < made.size(); ++i)
    if (!std::isnan(a.reading[i])) away.push_back(std::abs(a.reading[i] - b.reading[i]) / made[i].span());
  std::ranges::sort(away, std::greater());
  away.resize((away.size() + 1) / 2);
  return away.empty() ? 0 : mean(away);
}

// Of successive rests of one pose the longest.
std::vector<Rest> rests_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made) {
  std::vector<std::vector<double>> steady;
  std::vector<double> most;
  for (const auto& one : readings) steady.push_back(steadied(one, period_s));
  for (const model::Spread& one : made) most.push_back(kStillShare * one.span());
  std::vector<Rest> out;
  for (const StillPart& still : still_in(steady, most, period_s)) {
    Rest rest{still, {}};
    for (const auto& one : steady)
      rest.reading.push_back(std::accumulate(one.data() + still.from, one.data() + still.to, 0.0) /
                             static_cast<double>(still.to - still.from));
    if (out.empty() || distance(out.back(), rest, made) >= kApart)
      out.push_back(std::move(rest));
    else if (still.to - still.from > out.back().when.to - out.back().when.from)
      out.back() = std::move(rest);
  }
  return out;
}

}  // namespace

Turns turns_of(std::span<const double> readings, double turn) {
  std::vector<double> end;  // of each way, low and high in turn
  for (const std::size_t k : recording::ends_of_ways(readings, turn)) end.push_back(readings[k]);
  Turns out;
  for (std::size_t i = 0; i < end.size(); ++i) {
    const bool is_high = i > 0 ? end[i] > end[i - 1] : end[0] > end[1];
    (is_high ? out.high_ends : out.low_ends).push_back(end[i]);
    if (i > 0 && i + 1 < end.size()) (is_high ? out.high : out.low).push_back(end[i]);
    if (i < 2) continue;
    ++out.count;
    const double shorter = std::min(std::abs(end[i] - end[i - 1]), std::abs(end[i - 1] - end[i - 2]));
    out.there_and_back = std::max(out.there_and_back, shorter);
  }
  return out;
}

void turn_into_range(const model::Model& model, std::span<double> readings) {
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const model::Input& input = model.inputs[i];
    if (input.unit != "deg" && input.unit != "rad") continue;
    const double turn = input.unit == "deg" ? 360 : 2 * std::numbers::pi;
    if (input.valid_max - input.valid_min > turn) continue;
    const double turns = std::round((readings[i] - (input.valid_min + input.valid_max) / 2) / turn);
    if (std::abs(turns) <= 1) readings[i] -= turn * turns;
  }
}

model::Spread spread_of(std::vector<double> readings, std::span<const double> shares) {
  std::ranges::sort(readings);
  model::Spread out{{shares.begin(), shares.end()}, {}};
  for (const double share : shares) out.reading.push_back(quantile_of(readings, share));
  return out;
}

model::Spread spread_of(const model::Poses& poses) {
  const auto [low, high] = std::minmax(poses.open, poses.fist);
  return {{0.05, 0.95}, {low, high}};
}

double add_squares(double sum, const std::vector<double>& values, double unit) {
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) sum += (v - mean) * (v - mean) / unit;
  return sum;
}

std::vector<double> steadied(const std::vector<double>& values, double period_s) {
  const auto half = static_cast<std::size_t>(kMedian_s / period_s / 2);
  std::vector<double> out;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::size_t end = std::min(k + half + 1, values.size());
    out.push_back(median({values.data() + (k - std::min(k, half)), values.data() + end}));
  }
  return out;
}

std::vector<StillPart> still_in(const std::vector<std::vector<double>>& steady,
                                const std::vector<double>& most, double period_s,
                                const std::vector<std::uint8_t>& use) {
  const auto least = static_cast<std::size_t>(std::ceil(kStill_s / period_s));
  const std::size_t size = steady.front().size();
  std::vector<StillPart> out;
  for (std::size_t from = 0; from < size;) {
    std::size_t to = size;
    for (std::size_t i = 0; i < steady.size(); ++i) {
      double low = steady[i][from];
      double high = low;
      for (std::size_t k = from; k < to; ++k) {
        low = std::min(low, steady[i][k]);
        high = std::max(high, steady[i][k]);
        if (high - low > most[i] || (!use.empty() && use[k] == 0)) to = k;
      }
    }
    const bool is_long = to - from >= least;
    if (is_long) out.push_back({static_cast<Eigen::Index>(from), static_cast<Eigen::Index>(to)});
    from = is_long ? to : from + 1;
  }
  return out;
}

Held poses_in(const std::vector<std::vector<double>>& readings, double period_s,
              const std::vector<model::Spread>& made, const std::string& source) {
  const std::vector<Rest> rests = rests_in(readings, period_s, made);
  if (rests.empty())
    throw io::JobError(
        "{}: no second in which all sensors rest: hold the open hand, then a fist, each for three "
        "seconds; a sensor that only trembles is to be unplugged",
        source);
  std::pair<const Rest*, const Rest*> ends = {&rests.front(), &rests.front()};
  for (const Rest& one : rests)
    for (const Rest& other : rests)
      if (distance(one, other, made) > distance(*ends.first, *ends.second, made)) ends = {&one, &other};
  Held out;
  std::size_t others = 0;
  for (const Rest& rest : rests) {
    const double first = distance(rest, *ends.first, made);
    const double second = distance(rest, *ends.second, made);
    const bool is_end = &rest == &rests.front() || &rest == &rests.back();
    const bool is_at_ease = is_end && distance(rests.front(), rests.back(), made) < kApart;
    if (std::min(first, second) >= kApart)
      others += is_at_ease ? 0 : 1;
    else
      (first <= second ? out.open : out.fist).push_back(rest);
  }
  if (!out.fist.empty() && out.fist.front().when.from < out.open.front().when.from)
    std::swap(out.open, out.fist);
  if (others > 1 && 4 * others >= rests.size())
    throw io::JobError(
        "{}: {} of {} rests lie between the poses: is it a log of an open hand and a fist, each held "
        "for three seconds, and again?",
        source, others, rests.size());
  return out;
}

std::vector<double> readings_in(const std::vector<Rest>& rests, std::size_t sensor) {
  std::vector<double> out;
  for (const Rest& rest : rests)
    if (!std::isnan(rest.reading[sensor])) out.push_back(rest.reading[sensor]);
  return out;
}

void add_spread(const std::vector<Session>& sessions, Eigen::Index sensor, model::Input& input) {
  std::vector<model::Spread> all;  // of the sessions in which the sensor moved
  std::vector<double> middle;
  std::vector<double> log_span;
  for (const Session& session : sessions) {
    std::vector<double> readings = used_readings({&session, 1}, sensor);
    if (readings.empty()) continue;
    const model::Spread one = spread_of(std::move(readings), kSpreadShares);
    if (!(one.span() > 0)) continue;
    all.push_back(one);
    middle.push_back(one.middle());
    log_span.push_back(std::log(one.span()));
  }
  if (all.empty()) return;
  input.readings = model::Spread{all.front().share, std::vector<double>(all.front().share.size(), 0)};
  for (const model::Spread& one : all) {
    for (std::size_t i = 0; i < one.reading.size(); ++i)
      input.readings->reading[i] += one.reading[i] / static_cast<double>(all.size());
  }
  if (all.size() < 2) return;
  const auto freedom = static_cast<double>(all.size() - 1);
  input.donnings =
      model::DonningSpread{static_cast<int>(all.size()), std::sqrt(add_squares(0, middle, freedom)),
                           std::sqrt(add_squares(0, log_span, freedom))};
}

std::optional<model::Poses> poses_of(const std::vector<Session>& sessions, Eigen::Index sensor) {
  constexpr double kEnd = 0.1;
  constexpr std::size_t kLeast = 10;
  const std::vector<double> angles = used_angles(sessions);
  const std::vector<double> all = used_readings(sessions, sensor);
  if (angles.empty()) return {};
  const auto [least, most] = std::ranges::minmax(angles);
  const double range_deg = most - least;
  const auto median = [&](double from_deg, double to_deg) -> std::optional<double> {
    std::vector<double> readings;
    for (std::size_t k = 0; k < angles.size(); ++k)
      if (angles[k] >= from_deg && angles[k] <= to_deg) readings.push_back(all[k]);
    if (readings.size() < kLeast) return {};
    return identify::median(std::move(readings));
  };
  const auto open = median(least, least + kEnd * range_deg);
  const auto fist = median(most - kEnd * range_deg, most);
  if (!open || !fist || *open == *fist) return {};
  return model::Poses{*open, *fist};
}

void add_poses(const std::vector<Session>& sessions, Eigen::Index sensor, double sample_period_s,
               model::Input& input) {
  const auto valid = [&](const std::optional<model::Poses>& poses) {
    return poses && std::min(poses->open, poses->fist) >= input.valid_min &&
           std::max(poses->open, poses->fist) <= input.valid_max;
  };
  const auto poses = poses_of(sessions, sensor);
  if (!valid(poses)) return;
  input.poses = poses;
  std::vector<std::vector<double>> recordings;
  for (const Session& s : sessions) recordings.push_back(used_readings({&s, 1}, sensor));
  const auto turns = model::turns_of(recordings, sample_period_s, *poses);
  if (valid(turns)) input.turns = turns;
}

std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings) {
  model::Compensator<model::DoubleArithmetic> compensator(
      model);  // starts at rest: its first angle is the one held still
  std::vector<double> out;
  for (const auto& one : compensator.step(readings)) out.push_back(one.angle_deg);
  return out;
}

Reach reach_of(const model::Model& model, std::size_t input) {
  const model::Spread& spread = *model.inputs[input].readings;
  const double part = spread.span() / kStillParts;
  std::vector<double> readings;
  for (const model::Input& one : model.inputs)
    readings.push_back(one.readings->reading[one.readings->reading.size() / 2]);
  const auto angles_at = [&](int edge) {
    readings[input] = spread.reading.front() + edge * part;
    return still_angles(model, readings);
  };
  Reach out{std::vector<std::vector<double>>(model.joints.size()), {}};
  std::vector<double> before = angles_at(0);
  for (int edge = 1; edge <= kStillParts; ++edge) {
    const std::vector<double> angles = angles_at(edge);
    for (std::size_t j = 0; j < angles.size(); ++j) out.slopes[j].push_back((angles[j] - before[j]) / part);
    before = angles;
  }
  for (const std::vector<double>& slopes : out.slopes) {
    out.range_deg.push_back(part * std::accumulate(slopes.begin(), slopes.end(), 0.0));
    if (std::abs(out.range_deg.back()) > std::abs(out.most_deg)) out.most_deg = out.range_deg.back();
  }
  return out;
}

}  // namespace flexor::identify
