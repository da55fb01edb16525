// What a camera saw as evidence: the angles of the model, against those measured.
#pragma once

#include <vector>

#include "host/donning/recalibrate.hpp"

namespace flexor::donning {

// Each sample's error is that of the model where it was proven, of which only one a second counts as new; each joint's marks
// sit otherwise by 3 degrees (an unknown of its own); large errors count by their size (pseudo-Huber).
class CameraEvidence : public Evidence {
 public:
  // The part of `seen` from `begin` to `end`, shares of it; the model runs from its start all the same.
  CameraEvidence(const model::Model& model, const Seen& seen, std::vector<model::Spread> made, double begin,
                 double end);
  Eigen::Index unknowns() const override { return std::ssize(seen_.joints); }
  Rows rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const override;
  double mean_square_deg2(const std::vector<Line>& lines) const;

 private:
  std::vector<std::vector<double>> angles(const std::vector<Line>& lines) const;

  const model::Model& model_;
  const Seen& seen_;
  std::vector<model::Spread> made_;
  std::vector<double> error_deg_;  // of each seen joint
  double begin_;
  double end_;
};

// Sensors that a joint depends on which the camera saw move by 10 degrees or more.
std::vector<std::size_t> told_by_camera(const model::Model& model, const Seen& seen);

}  // namespace flexor::donning
