#include "host/identify/window.hpp"

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

double quantile_of(std::span<const double> sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  if (i + 1 >= sorted.size()) return sorted.back();
  return sorted[i] + (at - static_cast<double>(i)) * (sorted[i + 1] - sorted[i]);
}

Turns turns_of(std::span<const double> readings, double turn) {
  Turns out;
  int way = 0;  // of the motion: 1 up, -1 down, 0 not known
  double low = readings.front();
  double high = readings.front();
  std::vector<double> end;  // of each way
  for (const double u : readings) {
    low = std::min(low, u);
    high = std::max(high, u);
    const bool down = way >= 0 && u <= high - turn;
    const bool up = way <= 0 && u >= low + turn;
    if (!down && !up) continue;
    if (way > 0) out.high.push_back(high);
    if (way < 0) out.low.push_back(low);
    end.push_back(up ? low : high);
    (up ? out.low_ends : out.high_ends).push_back(up ? low : high);
    way = up ? 1 : -1;
    low = high = u;
  }
  if (way != 0) {
    end.push_back(way > 0 ? high : low);
    (way > 0 ? out.high_ends : out.low_ends).push_back(way > 0 ? high : low);
  }
  for (std::size_t i = 2; i < end.size(); ++i) {
    const double shorter = std::min(std::abs(end[i] - end[i - 1]), std::abs(end[i - 1] - end[i - 2]));
    out.there_and_back = std::max(out.there_and_back, shorter);
  }
  return out;
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

model::Spread mean_of(const std::vector<model::Spread>& all) {
  model::Spread out{all.front().share, std::vector<double>(all.front().share.size(), 0)};
  for (const model::Spread& one : all) {
    for (std::size_t i = 0; i < out.reading.size(); ++i)
      out.reading[i] += one.reading[i] / static_cast<double>(all.size());
  }
  return out;
}

Window window_of(std::span<const double> readings, std::span<const double> shares, double turn) {
  return {spread_of({readings.begin(), readings.end()}, shares), turns_of(readings, turn)};
}

double add_squares(double sum, const std::vector<double>& values, double unit) {
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) sum += (v - mean) * (v - mean) / unit;
  return sum;
}

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
