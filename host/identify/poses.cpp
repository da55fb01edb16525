#include "host/identify/poses.hpp"

#include <algorithm>

#include "host/identify/robust.hpp"
#include "host/model/tracking.hpp"

namespace flexor::identify {

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
