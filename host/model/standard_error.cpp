#include "host/model/standard_error.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {

StandardErrors::StandardErrors(const Model& model) : model_(model) {
  const Graph graph(model);
  for (const std::size_t signal : graph.joint)
    inputs_.emplace_back(graph.inputs[signal].begin(), graph.inputs[signal].end());
}

double StandardErrors::of(std::size_t joint, double angle_deg, std::span<const double> reading) const {
  const Accuracy& accuracy = *model_.joints[joint].accuracy;
  double out_deg = accuracy.at(angle_deg);
  for (const std::size_t i : inputs_[joint]) {
    const auto& seen = model_.inputs[i].readings;
    if (!seen || !std::isfinite(reading[i])) continue;
    const double beyond =
        std::max({0.0, seen->reading.front() - reading[i], reading[i] - seen->reading.back()});
    out_deg =
        std::hypot(out_deg, (accuracy.angle_deg.back() - accuracy.angle_deg.front()) / seen->span() * beyond);
  }
  return out_deg;
}

}  // namespace flexor::model
