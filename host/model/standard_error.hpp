// The standard error of an angle: a joint's accuracy there and, beyond the readings that were seen, how far the angle may have
// gone on unseen.
//   se^2 = accuracy(angle)^2 + sum over the joint's inputs of (angles seen / readings seen x distance beyond them)^2
// with the angles and readings between the outermost of Accuracy and of Input::readings: the slope of a straight line through both.
#pragma once

#include <span>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

class StandardErrors {
 public:
  explicit StandardErrors(const Model& model);  // which must outlive it
  // Of a joint that has an accuracy; `reading` has one for each input, NaN where there is none.
  double of(std::size_t joint, double angle_deg, std::span<const double> reading) const;

 private:
  const Model& model_;
  std::vector<std::vector<std::size_t>> inputs_;  // of each joint
};

}  // namespace flexor::model
