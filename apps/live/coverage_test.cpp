#include "apps/live/coverage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace flexor::live {
namespace {

// At 20 Hz, `reading(t_s)` counts with a little noise.
template <class Reading>
Covered covered_by(double seconds, Reading&& reading) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 0.6);
  Coverage coverage({"index"});
  for (double t_s = 0; t_s < seconds; t_s += 0.05)
    coverage.add(t_s, {std::round(reading(t_s) + normal(random))});
  return coverage.covered().front();
}

TEST(Coverage, AFingerThatRestsHasShownNothing) {
  const Covered c = covered_by(30, [](double) { return 500.0; });
  EXPECT_EQ(c.range, 0);
  EXPECT_FALSE(c.is_enough());
  EXPECT_EQ(c.missing, "move");
}

TEST(Coverage, WhatWasShownStaysShown) {
  const auto small_then_wide = [](double t) { return 500 + (t < 20 ? 20 : 200) * std::sin(2 * t); };
  Coverage coverage({"index"});
  double range = 0;
  for (double t_s = 0; t_s < 40; t_s += 0.05) {
    coverage.add(t_s, {small_then_wide(t_s)});
    EXPECT_GE(coverage.covered().front().range, range) << t_s;
    range = coverage.covered().front().range;
  }
}

TEST(Coverage, SlowBendsAloneLackHoldsAndQuickOnes) {
  const Covered c = covered_by(40, [](double t) { return 500 + 100 * std::sin(0.6 * t); });
  EXPECT_EQ(c.range, 1);
  EXPECT_EQ(c.slow, 1);
  EXPECT_EQ(c.fast, 0);
  EXPECT_FALSE(c.is_enough());
}

TEST(Coverage, BendsHoldsAndBothSpeedsAreEnough) {
  const Covered c = covered_by(60, [](double t) {
    if (t < 20) return 500 + 100 * std::sin(0.6 * t);          // slow
    if (t < 40) return 400 + 60.0 * std::floor((t - 20) / 5);  // held at four places
    return 500 + 100 * std::sin(4 * t);                        // quick
  });
  EXPECT_TRUE(c.is_enough()) << c.missing;
  EXPECT_EQ(c.holds, 1);
  EXPECT_EQ(c.fast, 1);
}

TEST(Coverage, HalfOfTheWayIsNoBend) {
  const Covered c = covered_by(40, [](double t) { return t < 2 ? 400 + 100 * t : 560 + 30 * std::sin(t); });
  EXPECT_LT(c.range, 0.5);
}

TEST(Coverage, APauseOfTheLogShowsNothing) {
  Coverage coverage({"index"});
  for (double t_s = 0; t_s < 3; t_s += 0.05) coverage.add(t_s, {500 + 100 * std::sin(t_s)});
  const Covered before = coverage.covered().front();
  for (int k = 0; k < 25; ++k) coverage.add(500 + 0.05 * k, {500 + 100 * std::sin(k)});
  EXPECT_EQ(coverage.covered().front().holds, before.holds);
}

}  // namespace
}  // namespace flexor::live
