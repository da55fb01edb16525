// What cross-validation leaves out must not help to choose the fold's knots, its start or its parameters.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/identify/folds.hpp"

namespace flexor::identify {
namespace {

// Slow and quick bends, noisy; the third quarter bends further than all others.
Data recorded() {
  std::mt19937 random(5);
  std::normal_distribution<double> noise;
  Data data;
  data.channel = "ring";
  data.period_s = 0.05;
  const int n = 1000;
  data.input.resize(n);
  data.angle_deg.resize(n);
  data.use.assign(static_cast<std::size_t>(n), 1);
  double x = 0;
  for (int k = 0; k < n; ++k) {
    const double t = k * data.period_s;
    const bool further = k >= n / 2 && k < 3 * n / 4;
    const double u = 500 + (further ? 250 : 120) * std::sin(0.9 * t) + 60 * std::sin(2.3 * t + 1);
    const double w = 10 + 70 * std::pow(u / 1000, 1.4);
    x = k == 0 ? w : x + 0.3 * (w - x);
    data.input(k) = u;
    data.angle_deg(k) = x + 0.3 * noise(random);
  }
  return data;
}

std::vector<Structure> structures() {
  return {blocks_of("curve(6) > lti(1)"), blocks_of("lti(1) > curve(6)"),
          blocks_of("hysteresis(1) > curve(6) > lti(1) > saturation")};
}

TEST(HeldBack, KnotsOfAFoldLieWhereItsOwnTrainingPartIs) {
  const Data data = recorded();
  for (const Structure& structure : structures()) {
    const std::vector<Fold> all = folds(structure, data);
    ASSERT_EQ(all.size(), static_cast<std::size_t>(kBlocks));
    const Fold& third = all[2];
    double low = 1e9;
    double high = -1e9;
    for (std::size_t k = 0; k < data.use.size(); ++k) {
      if (k >= third.first && k <= third.last) continue;
      low = std::min(low, data.input(static_cast<Eigen::Index>(k)));
      high = std::max(high, data.input(static_cast<Eigen::Index>(k)));
    }
    const Knots& knots = third.summary.knots;
    for (const auto* x : {&knots.input, &knots.output}) {
      if (x->empty()) continue;
      EXPECT_GE(x->front(), low) << text_of(structure);
      EXPECT_LE(x->back(), high) << text_of(structure);
    }
  }
}

TEST(HeldBack, OtherAnglesInABlockDoNotMoveTheFoldThatLeavesItOut) {
  const Data data = recorded();
  for (const Structure& structure : structures()) {
    const std::vector<Fold> before = folds(structure, data);
    {
      const std::size_t block = 2;
      Data spoilt = data;
      for (std::size_t k = before[block].first; k <= before[block].last; ++k) {
        spoilt.angle_deg(static_cast<Eigen::Index>(k)) =
            200 - 3 * data.angle_deg(static_cast<Eigen::Index>(k));
      }
      const std::vector<Fold> after = folds(structure, spoilt);
      EXPECT_EQ(after[block].summary.theta, before[block].summary.theta) << text_of(structure) << block;
      EXPECT_EQ(after[block].summary.knots.input, before[block].summary.knots.input);
      EXPECT_NE(after[1].summary.theta, before[1].summary.theta) << "the other folds do see it";
    }
  }
}

// The state of hysteresis and lags runs through the block; after the guard nothing of it may be left in the
// knots, and next to nothing in the parameters.
TEST(HeldBack, OtherReadingsInABlockDoNotMoveTheFoldThatLeavesItOut) {
  const Data data = recorded();
  for (const Structure& structure : structures()) {
    const std::vector<Fold> before = folds(structure, data);
    Data spoilt = data;
    for (std::size_t k = before[2].first; k <= before[2].last; ++k) {
      spoilt.input(static_cast<Eigen::Index>(k)) = 2000 + 500 * std::sin(0.2 * static_cast<double>(k));
    }
    const std::vector<Fold> after = folds(structure, spoilt);
    EXPECT_EQ(after[2].summary.knots.input, before[2].summary.knots.input) << text_of(structure);
    EXPECT_EQ(after[2].summary.knots.output, before[2].summary.knots.output) << text_of(structure);
    EXPECT_NEAR(after[2].summary.rmse_deg, before[2].summary.rmse_deg, 0.02) << text_of(structure);
  }
}

}  // namespace
}  // namespace flexor::identify
