// Which of the marks in a picture is which: the assignment that looks most like the skeleton.
//
//   cost = sum over links ((ln(length / (scale nominal))) / tolerance)^2 / 2     scale: the median of the
//   links'
//        + sum over angles (degrees outside the range / 10)^2 / 2
//        + sum over marks (ln(area / typical area))^2 / 2 + (ln(level / typical level))^2 / 2
// It does not depend on where the hand is, how large, how it is turned, or whether the picture is mirrored.
// Beam search: marks in the order of the links, the cheapest thousands of part assignments are kept.
#pragma once

#include <optional>
#include <vector>

#include "host/camera/joints.hpp"
#include "host/camera/marks.hpp"

namespace flexor::camera {

struct Assignment {
  std::vector<std::size_t> candidate;  // for each mark of the skeleton
  double cost = 0;
  // Cost of the best assignment that gives any mark to another candidate, minus this cost; large when there
  // is no other.
  double margin = 0;
};

inline constexpr double kKnownLength = 0.1;  // tolerance when lengths were measured in this video
inline constexpr double kMinMargin = 1.5;    // below it an assignment is a guess
inline constexpr double kMaxCost = 25;       // above it this is no hand of that kind

// `lengths`: one for each link of the skeleton, any unit. nullopt: fewer candidates than marks, or no
// assignment with links of half to twice their lengths.
std::optional<Assignment> assign(const Skeleton& skeleton, const std::vector<double>& lengths,
                                 double tolerance, const std::vector<Mark>& candidates);

}  // namespace flexor::camera
