#include "host/camera/angles.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>

namespace flexor::camera {
namespace {

constexpr double kRadians = std::numbers::pi / 180;

AngleRule rule(std::vector<std::size_t> marks) {
  AngleRule out;
  out.name = "joint";
  out.marks = std::move(marks);
  return out;
}

// A chain a, b, c that turns clockwise on the screen by `deg` at b.
std::vector<Point> chain(double deg, double first = 50, double second = 30) {
  return {{0, 0}, {first, 0}, {first + second * std::cos(deg * kRadians), second * std::sin(deg * kRadians)}};
}

const std::vector<Covariance> kExact(4);

TEST(Angles, AStraightJointIsZeroAndATurnIsItsOwnAngle) {
  for (const double deg : {-120.0, -45.0, 0.0, 10.0, 90.0, 170.0}) {
    EXPECT_NEAR(measure_angle(rule({0, 1, 2}), 1, chain(deg), kExact)->deg, deg, 1e-9);
    EXPECT_NEAR(measure_angle(rule({0, 1, 2}), -1, chain(deg), kExact)->deg, -deg, 1e-9);
  }
}

TEST(Angles, AnOpeningIsTheAngleBetweenTwoBonesAndHasNoSign) {
  AngleRule opening = rule({0, 1, 2});
  opening.opening = true;
  EXPECT_NEAR(measure_angle(opening, 1, chain(30), kExact)->deg, 150, 1e-9);
  EXPECT_NEAR(measure_angle(opening, -1, chain(-30), kExact)->deg, 150, 1e-9);
}

TEST(Angles, FourMarksMeasureAgainstAReferenceLineAndAnOffsetMovesIt) {
  AngleRule line = rule({0, 1, 2, 3});
  line.offset_deg = 90;
  const std::vector<Point> marks = {{0, 0}, {10, 0}, {300, 50}, {300, 80}};
  EXPECT_NEAR(measure_angle(line, 1, marks, kExact)->deg, 180, 1e-9);
}

TEST(Angles, MarksThatCoincideHaveNoAngle) {
  EXPECT_FALSE(measure_angle(rule({0, 1, 2}), 1, std::vector<Point>{{5, 5}, {5, 5}, {9, 9}}, kExact));
}

RC_GTEST_PROP(Angles, FlexionIsTheSameHoweverThePictureIsTurnedMovedScaledOrMirrored, ()) {
  const double deg = *rc::gen::inRange(-100, 140);
  std::vector<Point> marks = chain(deg);
  marks.push_back({20, 40});  // towards which a positive turn goes
  PositiveTurn positive;
  positive.by_marks = true;
  positive.from = 0;
  positive.to = 1;
  positive.toward = 3;
  const double turn = *rc::gen::inRange(0, 360) * kRadians;
  const double scale = *rc::gen::inRange(5, 50) / 10.0;
  const double mirror = *rc::gen::element(-1.0, 1.0);
  for (Point& p : marks) {
    const Point q = {mirror * scale * p.x, scale * p.y};
    p = {std::cos(turn) * q.x - std::sin(turn) * q.y + 300,
         std::sin(turn) * q.x + std::cos(turn) * q.y + 200};
  }
  RC_ASSERT(std::abs(measure_angle(rule({0, 1, 2}), turn_sign(positive, marks), marks, kExact)->deg - deg) <
            1e-6);
}

TEST(Angles, TheStandardErrorIsWhatTheMarksErrorsMakeOfIt) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const std::vector<Covariance> covariances = {{0.04, 0.01, 0.09}, {0.02, -0.01, 0.05}, {0.08, 0, 0.03}};
  const std::vector<Point> exact = chain(35, 60, 25);
  const Angle estimate = *measure_angle(rule({0, 1, 2}), 1, exact, covariances);
  double squares = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    std::vector<Point> marks = exact;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& [xx, xy, yy] = covariances[k];
      const double a = std::sqrt(xx);
      const double u = normal(random);
      marks[k].x += a * u;
      marks[k].y += xy / a * u + std::sqrt(yy - xy * xy / xx) * normal(random);
    }
    squares += std::pow(measure_angle(rule({0, 1, 2}), 1, marks, kExact)->deg - estimate.deg, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / kDraws), std::sqrt(estimate.variance_deg2),
              0.02 * std::sqrt(estimate.variance_deg2));
}

}  // namespace
}  // namespace flexor::camera
