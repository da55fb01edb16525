#include "host/posture/joints.hpp"

#include <algorithm>
#include <limits>

namespace flexor::posture {

std::optional<int> find_joint(std::string_view name) {
  const auto it = std::ranges::find(kJointNames, name);
  if (it == kJointNames.end()) return std::nullopt;
  return static_cast<int>(it - kJointNames.begin());
}

Limits anatomical_limits() {
  constexpr double kSpread_deg = 10;
  constexpr double kNone_deg = std::numeric_limits<double>::infinity();
  Limits limits{Hand::Constant(kNone_deg), Hand::Constant(-kNone_deg)};
  const auto set = [&](std::string_view part, double flexion_deg, double extension_deg) {
    for (int j = 0; j < kJoints; ++j) {
      const std::string_view name = kJointNames[static_cast<std::size_t>(j)];
      if (!name.ends_with(part) || name.starts_with("thumb")) continue;
      limits.low_deg[j] = -flexion_deg - kSpread_deg;
      limits.high_deg[j] = extension_deg + kSpread_deg;
    }
  };
  set("_mcp", 90, 45);
  set("_pip", 100, 0);
  set("_dip", 90, 0);
  return limits;
}

Eigen::Matrix<double, Eigen::Dynamic, kJoints> input_matrix(const std::vector<Input>& inputs) {
  Eigen::Matrix<double, Eigen::Dynamic, kJoints> matrix(inputs.size(), kJoints);
  matrix.setZero();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (const int joint : inputs[i].joints) matrix(static_cast<Eigen::Index>(i), joint) = 1;
  }
  return matrix;
}

}  // namespace flexor::posture
