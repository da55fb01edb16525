// What cross-validation leaves out must not help to choose the fold's knots, its start or its parameters.
#include <gtest/gtest.h>

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
  data.weight.setOnes(n);
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

std::vector<Fold> folds(const Data& data) {
  return folds_of(used_rows(data), {0, data.size()}, data.period_s);
}

TEST(HeldBack, OtherAnglesAndReadingsInABlockDoNotMoveTheFoldThatLeavesItOut) {
  const Data data = recorded();
  const std::vector<Fold> all = folds(data);
  Data angles = data;
  Data readings = data;
  for (Eigen::Index k = all[2].front().first; k <= all[2].front().last; ++k) {
    angles.angle_deg(k) = 200 - 3 * data.angle_deg(k);
    readings.input(k) = 2000 + 500 * std::sin(0.2 * static_cast<double>(k));
  }
  for (const Structure& structure : structures()) {
    const std::vector<Summary> before = fit_folds(structure, data, {all[1], all[2]}, {});
    const std::vector<Summary> after = fit_folds(structure, angles, {all[1], all[2]}, {});
    EXPECT_EQ(after[1].theta, before[1].theta) << text_of(structure);
    EXPECT_EQ(after[1].knots.input, before[1].knots.input);
    EXPECT_NE(after[0].theta, before[0].theta) << "the other folds do see it";
    // The state of hysteresis and lags runs through the block; after the guard nothing of it may be left in the
    // knots, and next to nothing in the parameters.
    const Summary third = fit_folds(structure, readings, {all[2]}, {}).front();
    EXPECT_EQ(third.knots.input, before[1].knots.input) << text_of(structure);
    EXPECT_EQ(third.knots.output, before[1].knots.output) << text_of(structure);
    EXPECT_NEAR(third.fitted_rmse_deg, before[1].fitted_rmse_deg, 0.02) << text_of(structure);
  }
}

}  // namespace
}  // namespace flexor::identify
