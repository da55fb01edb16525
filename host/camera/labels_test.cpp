#include "host/camera/labels.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexor::camera {
namespace {

Skeleton green_skeleton() {
  return load_joints(FLEXOR_SOURCE_DIR "/models/joints/green_markers.json").skeletons[0];
}

// A pinching hand, in the order of the joint file's marks; the real video's first frame is of the same kind.
const std::vector<Point> kHand = {{718, 336}, {595, 231}, {479, 205}, {429, 234},
                                  {369, 256}, {603, 374}, {498, 393}, {425, 399}};

Mark mark(Point at, double area = 500) {
  Mark out;
  out.centre = at;
  out.area_px = area;
  out.level = 40;
  return out;
}

RC_GTEST_PROP(Labels, AreRightHoweverTheHandLiesInThePicture, ()) {
  const Skeleton skeleton = green_skeleton();
  const double turn = *rc::gen::inRange(0, 360) * std::numbers::pi / 180;
  const double scale = *rc::gen::inRange(3, 20) / 10.0;
  const double mirror = *rc::gen::element(-1.0, 1.0);
  const auto order =
      *rc::gen::map(rc::gen::container<std::vector<int>>(8, rc::gen::arbitrary<int>()), [](const auto& keys) {
        std::vector<std::size_t> out = {0, 1, 2, 3, 4, 5, 6, 7};
        std::ranges::stable_sort(out, {}, [&](std::size_t i) { return keys[i]; });
        return out;
      });
  std::vector<Mark> candidates(8);
  for (std::size_t i = 0; i < 8; ++i) {
    const Point p = {mirror * scale * kHand[i].x, scale * kHand[i].y};
    candidates[order[i]] =
        mark({std::cos(turn) * p.x - std::sin(turn) * p.y, std::sin(turn) * p.x + std::cos(turn) * p.y});
  }
  const auto found = assign(skeleton, skeleton.lengths(), skeleton.length_tolerance, candidates);
  RC_ASSERT(found.has_value());
  RC_ASSERT(found->cost < kMaxCost);
  RC_ASSERT(found->margin > kMinMargin);
  for (std::size_t i = 0; i < 8; ++i) RC_ASSERT(found->candidate[i] == order[i]);
}

TEST(Labels, AChainThatLooksTheSameFromBothEndsIsAmbiguous) {
  Skeleton chain;
  chain.name = "chain";
  chain.marks = {"a", "b", "c"};
  chain.links = {{0, 1, 10}, {1, 2, 10}};
  AngleRule joint;
  joint.marks = {0, 1, 2};
  joint.min_deg = -20;
  joint.max_deg = 120;
  chain.angles = {joint};
  const auto found = assign(chain, {10, 10}, 0.35, {mark({0, 0}), mark({10, 0}), mark({20, 0})});
  ASSERT_TRUE(found);
  EXPECT_LT(found->margin, kMinMargin);
  chain.first_link = Point{1, 0};
  const auto sure = assign(chain, {10, 10}, 0.35, {mark({0, 0}), mark({10, 0}), mark({20, 0})});
  EXPECT_GT(sure->margin, kMinMargin);
  EXPECT_EQ(sure->candidate[0], 0U);
}

TEST(Labels, TooFewMarksAreNoHand) {
  const Skeleton skeleton = green_skeleton();
  EXPECT_FALSE(assign(skeleton, skeleton.lengths(), 0.35, {mark({1, 2}), mark({30, 40})}));
  EXPECT_FALSE(assign(skeleton, skeleton.lengths(), 0.35, {}));
}

}  // namespace
}  // namespace flexor::camera
