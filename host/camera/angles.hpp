// From marks to angles, and how well they are known.
//
//   turn = atan2(u x v, u . v),   u = b - a,  v = d - c        degrees
// A mark's error e turns a line u by (u x e) / |u|^2; with the marks' covariances C_i
//   se^2 = sum_i g_i' C_i g_i,   g_i = d turn / d mark_i
// so that short bones and faint marks have large standard errors.
#pragma once

#include <numbers>
#include <optional>
#include <span>

#include "host/camera/joints.hpp"

namespace flexor::camera {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // of a radian

struct Angle {
  double deg = 0;
  double variance_deg2 = 0;
};

// +1 or -1 by which the rule's raw turn (clockwise on the screen, as y grows downwards) is multiplied.
double turn_sign(const PositiveTurn& rule, std::span<const Point> marks);

// `sign` from turn_sign; marks in the order of the skeleton. nullopt: two marks of one line coincide.
std::optional<Angle> measure_angle(const AngleRule& rule, double sign, std::span<const Point> marks,
                                   std::span<const Covariance> covariances);

}  // namespace flexor::camera
