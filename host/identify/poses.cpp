#include "host/identify/poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/identify/robust.hpp"
#include "host/model/tracking.hpp"

namespace flexor::identify {

namespace {

constexpr std::array kShares = {0.02, 0.1, 0.5, 0.9, 0.98};

// Of one session; empty where nothing moved.
std::vector<double> quantiles(const Session& session, Eigen::Index sensor) {
  std::vector<double> readings;
  for (Eigen::Index k = 0; k < session.input.rows(); ++k) {
    if (session.use[static_cast<std::size_t>(k)]) readings.push_back(session.input(k, sensor));
  }
  if (readings.empty()) return {};
  std::ranges::sort(readings);
  std::vector<double> out;
  for (const double share : kShares) out.push_back(quantile(readings, share));
  if (out.front() == out.back()) return {};
  return out;
}

std::vector<std::vector<double>> all_quantiles(const std::vector<Session>& sessions, Eigen::Index sensor) {
  std::vector<std::vector<double>> out;
  for (const Session& session : sessions) {
    if (auto one = quantiles(session, sensor); !one.empty()) out.push_back(std::move(one));
  }
  return out;
}

double standard_deviation(const std::vector<double>& values) {
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

}  // namespace

std::optional<model::Spread> readings_of(const std::vector<Session>& sessions, Eigen::Index sensor) {
  const auto all = all_quantiles(sessions, sensor);
  if (all.empty()) return {};
  model::Spread out{{kShares.begin(), kShares.end()}, std::vector<double>(kShares.size(), 0)};
  for (const auto& one : all) {
    for (std::size_t i = 0; i < one.size(); ++i) out.reading[i] += one[i] / static_cast<double>(all.size());
  }
  return out;
}

std::optional<model::DonningSpread> donning_spread(const std::vector<Session>& sessions,
                                                   Eigen::Index sensor) {
  const auto all = all_quantiles(sessions, sensor);
  if (all.size() < 2) return {};
  std::vector<double> middle;
  std::vector<double> log_span;
  for (const auto& one : all) {
    middle.push_back((one.front() + one.back()) / 2);
    log_span.push_back(std::log(one.back() - one.front()));
  }
  return model::DonningSpread{static_cast<int>(all.size()), standard_deviation(middle),
                              standard_deviation(log_span)};
}

std::optional<model::Poses> poses_of(const std::vector<Session>& sessions, Eigen::Index sensor) {
  constexpr double kEnd = 0.1;
  constexpr std::size_t kLeast = 10;
  std::vector<std::pair<double, double>> samples;  // angle, reading
  for (const Session& s : sessions) {
    for (Eigen::Index k = 0; k < s.angle_deg.size(); ++k) {
      if (s.use[static_cast<std::size_t>(k)]) samples.emplace_back(s.angle_deg(k), s.input(k, sensor));
    }
  }
  if (samples.empty()) return {};
  const auto [least, most] = std::ranges::minmax_element(samples);
  const double range_deg = most->first - least->first;
  const auto median = [&](double from_deg, double to_deg) -> std::optional<double> {
    std::vector<double> readings;
    for (const auto& [angle, reading] : samples) {
      if (angle >= from_deg && angle <= to_deg) readings.push_back(reading);
    }
    if (readings.size() < kLeast) return {};
    std::ranges::sort(readings);
    return quantile(readings, 0.5);
  };
  const auto open = median(least->first, least->first + kEnd * range_deg);
  const auto fist = median(most->first - kEnd * range_deg, most->first);
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
  for (const Session& s : sessions) {
    std::vector<double>& readings = recordings.emplace_back();
    for (Eigen::Index k = 0; k < s.angle_deg.size(); ++k) {
      if (s.use[static_cast<std::size_t>(k)]) readings.push_back(s.input(k, sensor));
    }
  }
  const auto turns = model::turns_of(recordings, sample_period_s, *poses);
  if (valid(turns)) input.turns = turns;
}

}  // namespace flexor::identify
