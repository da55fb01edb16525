#include "host/identify/still_map.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

constexpr double kFaded_s = 10;
constexpr double kMostMapSteps = 1000;
constexpr int kStillParts = 8;

}  // namespace

std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings) {
  model::Compensator<model::DoubleArithmetic> compensator(model);
  const int steps = static_cast<int>(std::clamp(kFaded_s / model.sample_period_s, 1.0, kMostMapSteps));
  for (int k = 1; k < steps; ++k) (void)compensator.step(readings);
  std::vector<double> out;
  for (const auto& one : compensator.step(readings)) out.push_back(one.angle_deg);
  return out;
}

Reach reach_of(const model::Model& model, std::size_t input) {
  const model::Spread& spread = *model.inputs[input].readings;
  std::vector<double> readings;
  for (const model::Input& one : model.inputs)
    readings.push_back(one.readings->reading[one.readings->reading.size() / 2]);
  std::vector<std::vector<double>> angles;  // at the edges of the parts
  for (int i = 0; i <= kStillParts; ++i) {
    readings[input] = spread.reading.front() + spread.span() * i / kStillParts;
    angles.push_back(still_angles(model, readings));
  }
  Reach out;
  double most_bent = 0;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    std::vector<double>& slope = out.slopes.emplace_back();
    for (std::size_t i = 0; i + 1 < angles.size(); ++i)
      slope.push_back((angles[i + 1][j] - angles[i][j]) / (spread.span() / kStillParts));
    const auto [low, high] = std::ranges::minmax(angles, {}, [&](const auto& all) { return all[j]; });
    out.range_deg.push_back(high[j] - low[j]);
    out.most_deg = std::max(out.most_deg, out.range_deg.back());
    const double bent = std::accumulate(slope.begin(), slope.end(), 0.0);
    if (std::abs(bent) > std::abs(most_bent)) most_bent = bent;
  }
  out.bends = most_bent > 0 ? 1 : most_bent < 0 ? -1 : 0;
  return out;
}

}  // namespace flexor::identify
