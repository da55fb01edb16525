#include "host/identify/poses.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/identify/robust.hpp"
#include "host/identify/window.hpp"
#include "host/model/tracking.hpp"

namespace flexor::identify {

namespace {

constexpr double kStill_s = 1;
constexpr double kMedian_s = 0.5;
constexpr double kStillShare = 0.125;  // of the span: the range of what rests
constexpr double kApart = 0.3;         // of the span: rests that are nearer are one

// Of the sessions in which the sensor moved.
std::vector<model::Spread> spreads_of(const std::vector<Session>& sessions, Eigen::Index sensor) {
  std::vector<model::Spread> out;
  for (const Session& session : sessions) {
    std::vector<double> readings = used_readings({&session, 1}, sensor);
    if (readings.empty()) continue;
    if (!(out.emplace_back(spread_of(std::move(readings), kSpreadShares)).span() > 0)) out.pop_back();
  }
  return out;
}

// The running median over kMedian_s: neither a loose contact's spike nor a tremor ends a hold.
std::vector<double> steadied(const std::vector<double>& readings, double period_s) {
  const auto half = static_cast<std::size_t>(kMedian_s / period_s / 2);
  std::vector<double> out;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const std::size_t end = std::min(k + half + 1, readings.size());
    out.push_back(median({readings.data() + (k - std::min(k, half)), readings.data() + end}));
  }
  return out;
}

// The longest stretch from `begin` on in which no sensor moves.
std::size_t still_until(const std::vector<std::vector<double>>& readings, std::size_t begin,
                        const std::vector<model::Spread>& made) {
  std::size_t end = readings.front().size();
  for (std::size_t i = 0; i < readings.size(); ++i) {
    double low = readings[i][begin];
    double high = low;
    for (std::size_t k = begin; k < end; ++k) {
      low = std::min(low, readings[i][k]);
      high = std::max(high, readings[i][k]);
      if (high - low > kStillShare * made[i].span()) end = k;
    }
  }
  return end;
}

double apart(const Rest& a, const Rest& b, const std::vector<model::Spread>& made) {
  double most = 0;
  for (std::size_t i = 0; i < made.size(); ++i)
    most = std::max(most, std::abs(a.reading[i] - b.reading[i]) / made[i].span());
  return most;
}

}  // namespace

std::vector<Rest> rests_in(const std::vector<std::vector<double>>& readings, double period_s,
                           const std::vector<model::Spread>& made) {
  std::vector<std::vector<double>> steady;
  for (const auto& one : readings) steady.push_back(steadied(one, period_s));
  const auto least = static_cast<std::size_t>(std::ceil(kStill_s / period_s));
  std::vector<Rest> out;
  for (std::size_t k = 0; k < steady.front().size();) {
    const std::size_t end = still_until(steady, k, made);
    if (end - k < least) {
      ++k;
      continue;
    }
    Rest rest{k, end, {}};
    for (const auto& one : steady)
      rest.reading.push_back(std::accumulate(one.data() + k, one.data() + end, 0.0) /
                             static_cast<double>(end - k));
    if (!out.empty() && apart(out.back(), rest, made) < kApart) {
      if (rest.length() > out.back().length()) out.back() = rest;
    } else {
      out.push_back(std::move(rest));
    }
    k = end;
  }
  return out;
}

std::optional<model::Spread> readings_of(const std::vector<Session>& sessions, Eigen::Index sensor) {
  const auto all = spreads_of(sessions, sensor);
  return all.empty() ? std::nullopt : std::optional(mean_of(all));
}

std::optional<model::DonningSpread> donning_spread(const std::vector<Session>& sessions,
                                                   Eigen::Index sensor) {
  const auto all = spreads_of(sessions, sensor);
  if (all.size() < 2) return {};
  std::vector<double> middle;
  std::vector<double> log_span;
  for (const model::Spread& one : all) {
    middle.push_back(one.middle());
    log_span.push_back(std::log(one.span()));
  }
  const auto freedom = static_cast<double>(all.size() - 1);
  return model::DonningSpread{static_cast<int>(all.size()), std::sqrt(add_squares(0, middle, freedom)),
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

}  // namespace flexor::identify
