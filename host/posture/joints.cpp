#include "host/posture/joints.hpp"

#include <algorithm>

namespace flexor::posture {

std::optional<int> find_joint(std::string_view name) {
  const auto it = std::ranges::find(kJointNames, name);
  if (it == kJointNames.end()) return std::nullopt;
  return static_cast<int>(it - kJointNames.begin());
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
