#include "host/camera/angles.hpp"

#include <cmath>

namespace flexor::camera {
namespace {

// How a line's direction follows its end.
Point direction_gradient(Point u) { return Point(-u.y, u.x) / u.dot(u); }

}  // namespace

double turn_sign(const PositiveTurn& rule, std::span<const Point> marks) {
  if (!rule.by_marks) return rule.clockwise ? 1 : -1;
  return (marks[rule.to] - marks[rule.from]).cross(marks[rule.toward] - marks[rule.from]) >= 0 ? 1 : -1;
}

std::optional<Angle> measure_angle(const AngleRule& rule, double sign, std::span<const Point> marks,
                                   std::span<const Covariance> covariances) {
  const bool three = rule.marks.size() == 3;
  std::array<std::size_t, 4> at = {rule.marks[0], rule.marks[1], rule.marks[three ? 1 : 2],
                                   rule.marks[three ? 2 : 3]};
  // An opening is between b -> a and b -> c.
  if (rule.opening) std::swap(at[0], at[1]);
  const Point u = marks[at[1]] - marks[at[0]];
  const Point v = marks[at[3]] - marks[at[2]];
  if (u.dot(u) < 1 || v.dot(v) < 1) return std::nullopt;
  Angle out;
  const double turn = std::atan2(u.cross(v), u.dot(v)) * kDegrees;
  out.deg = (rule.opening ? std::abs(turn) : (rule.negative ? -sign : sign) * turn) + rule.offset_deg;
  const Point gu = direction_gradient(u);
  const Point gv = direction_gradient(v);
  std::array<Point, 4> gradient = {gu, -gu, -gv, gv};
  // Marks that end one line and begin the other count once, with both parts together.
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = i + 1; j < 4; ++j) {
      if (at[i] != at[j]) continue;
      gradient[i] += gradient[j];
      gradient[j] = {};
    }
    const Point g = kDegrees * gradient[i];
    const Covariance& c = covariances[at[i]];
    out.variance_deg2 += g.x * g.x * c[0] + 2 * g.x * g.y * c[1] + g.y * g.y * c[2];
  }
  return out;
}

}  // namespace flexor::camera
