#include "host/donning/still_map.hpp"

#include <algorithm>
#include <cmath>

#include "host/model/compensator.hpp"

namespace flexor::donning {
namespace {

constexpr double kFaded_s = 10;
constexpr double kMostMapSteps = 1000;
constexpr int kStillParts = 8;

using Compensator = model::Compensator<model::DoubleArithmetic>;

std::vector<double> medians(const model::Model& model) {
  std::vector<double> out;
  for (const model::Input& input : model.inputs) {
    const auto& spread = input.readings;
    out.push_back(spread ? spread->reading[spread->reading.size() / 2]
                         : (input.valid_min + input.valid_max) / 2);
  }
  return out;
}

std::vector<double> rested(Compensator compensator, double period_s, const std::vector<double>& readings) {
  const int steps = static_cast<int>(std::clamp(kFaded_s / period_s, 1.0, kMostMapSteps));
  std::vector<double> out;
  for (int k = 0; k < steps; ++k) {
    const auto angles = compensator.step(readings);
    if (k + 1 < steps) continue;
    for (const auto& one : angles) out.push_back(one.angle_deg);
  }
  return out;
}

// At the kStillParts + 1 edges of the parts.
std::vector<std::vector<double>> along(const model::Model& model, std::size_t input) {
  const Compensator fresh(model);
  const model::Spread& spread = *model.inputs[input].readings;
  std::vector<double> readings = medians(model);
  std::vector<std::vector<double>> out;
  for (int i = 0; i <= kStillParts; ++i) {
    readings[input] = spread.reading.front() + spread.span() * i / kStillParts;
    out.push_back(rested(fresh, model.sample_period_s, readings));
  }
  return out;
}

}  // namespace

std::vector<double> still_angles(const model::Model& model, const std::vector<double>& readings) {
  return rested(Compensator(model), model.sample_period_s, readings);
}

std::vector<std::vector<double>> slopes(const model::Model& model, std::size_t input) {
  const auto angles = along(model, input);
  const double part = model.inputs[input].readings->span() / kStillParts;
  std::vector<std::vector<double>> out(model.joints.size());
  for (std::size_t i = 0; i + 1 < angles.size(); ++i) {
    for (std::size_t j = 0; j < out.size(); ++j) out[j].push_back((angles[i + 1][j] - angles[i][j]) / part);
  }
  return out;
}

std::vector<double> ranges_deg(const model::Model& model, std::size_t input) {
  const auto angles = along(model, input);
  std::vector<double> out;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const auto [low, high] = std::ranges::minmax_element(angles, {}, [&](const auto& all) { return all[j]; });
    out.push_back((*high)[j] - (*low)[j]);
  }
  return out;
}

}  // namespace flexor::donning
