#include "host/score/score.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "host/io/io.hpp"

#include "host/score/least_squares.hpp"

namespace flexor::score {
namespace {

std::vector<double> grid(std::size_t n, double period_s) {
  std::vector<double> t(n);
  for (std::size_t k = 0; k < n; ++k) t[k] = static_cast<double>(k) * period_s;
  return t;
}

TEST(Score, ClosedFormsOfAConstantError) {
  const auto t = grid(101, 0.1);
  std::vector<double> y(t.size());
  std::vector<double> estimate(t.size());
  for (std::size_t k = 0; k < t.size(); ++k) {
    y[k] = k % 2 == 0 ? 10 : 30;
    estimate[k] = y[k] + 3;
  }
  const Score s = score(t, y, estimate);
  EXPECT_DOUBLE_EQ(s.rmse_deg, 3);
  EXPECT_DOUBLE_EQ(s.max_abs_deg, 3);
  EXPECT_DOUBLE_EQ(s.p95_abs_deg, 3);
  EXPECT_NEAR(s.iae_deg_s, 30, 1e-9);
  EXPECT_NEAR(s.r2, 1 - 9.0 / 100, 1e-3);
  EXPECT_NEAR(s.fit_percent, 100 * (1 - 3.0 / 10), 0.1);
  EXPECT_EQ(s.samples, 101u);
}

TEST(Score, FindsAndRemovesAConstantLag) {
  const auto t = grid(2000, 0.05);
  const auto motion = [](double at) { return 50 + 40 * std::sin(2 * std::numbers::pi * at / 7); };
  for (const double lag : {-0.31, 0.0, 0.02, 0.4}) {
    std::vector<double> y;
    std::vector<double> estimate;
    for (const double at : t) {
      y.push_back(motion(at));
      estimate.push_back(motion(at - lag));
    }
    const Score s = score(t, y, estimate);
    EXPECT_NEAR(s.best_lag_s, lag, 0.005);
    EXPECT_LT(s.lag_removed_rmse_deg, 0.6);  // the ends have nothing to be compared with
    if (lag != 0) {
      EXPECT_GT(s.rmse_deg, s.lag_removed_rmse_deg);
    }
  }
}

TEST(Score, ACausalDelayCostsDistanceTimesLag) {
  // One 85-degree move at any speed, seen tau late: the integral of the absolute error is 85 tau.
  const auto t = grid(1001, 0.01);
  std::vector<double> y;
  std::vector<double> late;
  for (const double at : t) {
    y.push_back(85 * std::clamp(at - 4, 0.0, 1.0));
    late.push_back(85 * std::clamp(at - 4.1, 0.0, 1.0));
  }
  EXPECT_NEAR(score(t, y, late).iae_deg_s, 8.5, 0.01);
}

TEST(Score, MetricsAgreeWithEachOther) {
  EXPECT_TRUE(rc::check([](const std::vector<std::pair<int8_t, int8_t>>& pairs) {
    RC_PRE(pairs.size() > 2u);
    std::vector<double> y;
    std::vector<double> estimate;
    for (const auto& [a, b] : pairs) {
      y.push_back(a);
      estimate.push_back(b);
    }
    RC_PRE(*std::max_element(y.begin(), y.end()) > *std::min_element(y.begin(), y.end()));
    const Score s = score(grid(y.size(), 0.1), y, estimate);
    RC_ASSERT(s.p95_abs_deg <= s.max_abs_deg);
    RC_ASSERT(s.rmse_deg <= s.max_abs_deg + 1e-9);
    RC_ASSERT(s.lag_removed_rmse_deg <= s.rmse_deg + 1e-9);
    RC_ASSERT(std::abs(s.r2 - (1 - std::pow(1 - s.fit_percent / 100, 2))) < 1e-9);
  }));
}

TEST(Score, NoiseOfTheEstimateIsNotTakenForALag) {
  const auto t = grid(2000, 0.05);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 2);
    std::vector<double> y;
    std::vector<double> estimate;
    for (const double at : t) {
      y.push_back(50 + 40 * std::sin(at));
      estimate.push_back(y.back() + noise(random));
    }
    const Score s = score(t, y, estimate);
    EXPECT_NEAR(s.best_lag_s, 0, 0.01);
    EXPECT_NEAR(s.lag_removed_rmse_deg, s.rmse_deg, 0.02 * s.rmse_deg);
  }
}

TEST(Score, ALagOutsideTheSearchIsAtItsEdge) {
  const auto t = grid(4000, 0.05);
  for (const double lag : {0.9, 1.01, 1.2, -1.05}) {
    std::vector<double> y;
    std::vector<double> estimate;
    for (const double at : t) {
      y.push_back(50 + 40 * std::sin(2 * at));
      estimate.push_back(50 + 40 * std::sin(2 * (at - lag)));
    }
    EXPECT_EQ(score(t, y, estimate).lag_at_edge, std::abs(lag) > 1) << lag;
  }
}

TEST(Compare, WhatLiesInAGapOfTheMeasuredAngleIsLeftOutAndCounted) {
  const auto motion = [](double at) { return 50 + 40 * std::sin(at); };
  std::vector<double> measured_t;
  std::vector<double> measured;
  for (const double at : grid(1200, 0.05)) {
    if (at > 10.01 && at < 49.99) continue;
    measured_t.push_back(at);
    measured.push_back(motion(at));
  }
  const auto t = grid(1200, 0.05);
  std::vector<double> estimate;
  for (const double at : t) estimate.push_back(motion(at) + 1);
  const Score s = compare({measured_t, measured, 0.3}, {t, estimate, 0.3});
  EXPECT_NEAR(s.rmse_deg, 1, 1e-9);
  EXPECT_EQ(s.samples + s.left_out, 1200u);
  EXPECT_EQ(s.left_out, 799u);
  EXPECT_NEAR(s.iae_deg_s, 10 + 9.95, 0.01);  // nothing is known of the forty seconds between
}

TEST(Compare, EveryRowOfABurstCounts) {
  const auto t = grid(400, 0.05);
  std::vector<double> twice_t;
  std::vector<double> twice;
  std::vector<double> y;
  for (const double at : t) {
    y.push_back(50 + 40 * std::sin(at));
    twice_t.insert(twice_t.end(), {at, at});
    twice.insert(twice.end(), {y.back(), y.back() + 10});
  }
  EXPECT_NEAR(compare({t, y}, {twice_t, twice}).rmse_deg, std::sqrt(50.0), 1e-9);
  EXPECT_NEAR(compare({twice_t, twice}, {t, y}).rmse_deg, 5, 1e-9);
}

TEST(Score, ThePercentileAndTheIntegralWithoutTheLagAreWhatTheyAreCalled) {
  const auto t = grid(1001, 0.01);
  std::vector<double> y;
  std::vector<double> estimate;
  for (std::size_t k = 0; k < t.size(); ++k) {
    y.push_back(50 + 40 * std::sin(t[k]));
    estimate.push_back(y[k] +
                       static_cast<double>((k * 617) % 1001) / 100);  // errors from 0 to 10, all of them
  }
  EXPECT_NEAR(score(t, y, estimate).p95_abs_deg, 9.5, 0.02);
  std::vector<double> late;
  for (const double at : t) late.push_back(50 + 40 * std::sin(at - 0.2) + 3);
  const Score s = score(t, y, late);
  EXPECT_NEAR(s.lag_removed_iae_deg_s, 3 * 9.8, 0.5);
  EXPECT_GT(s.iae_deg_s, s.lag_removed_iae_deg_s + 1);
}

TEST(Compare, LessThanASecondIsNoComparison) {
  const auto t = grid(100, 0.05);
  std::vector<double> y;
  for (const double at : t) y.push_back(at);
  std::vector<double> later = t;
  for (double& at : later) at += 4.2;
  EXPECT_THROW((void)compare({t, y}, {later, y}), io::InputError);
  for (double& at : later) at -= 2;
  EXPECT_NO_THROW((void)compare({t, y}, {later, y}));
}

TEST(Score, AConstantReferenceIsRefused) {
  const auto t = grid(10, 0.1);
  EXPECT_THROW((void)score(t, std::vector<double>(10, 5), std::vector<double>(10, 6)), io::JobError);
}

// Whatever stands where nothing was measured.
TEST(Score, WhatWasNotSeenIsNotScored) {
  std::vector<double> t, measured, estimated;
  std::vector<std::uint8_t> unseen;
  for (int k = 0; k < 400; ++k) {
    t.push_back(0.05 * k);
    measured.push_back(40 * std::sin(t.back()));
    estimated.push_back(measured.back() + (k % 2 == 0 ? 1 : -1));
    unseen.push_back(k >= 100 && k < 200);
    if (unseen.back() != 0) measured.back() = 1000;
  }
  const flexor::score::Score s = score_seen(t, measured, estimated, unseen);
  EXPECT_NEAR(s.rmse_deg, 1, 1e-9);
  EXPECT_EQ(s.left_out, 100U);
  EXPECT_EQ(s.samples, 300U);
  ASSERT_TRUE(in_words_left_out(s));
  EXPECT_NE(in_words_left_out(s)->find("25 %"), std::string::npos);
  EXPECT_GT(score(t, measured, estimated).rmse_deg, 100);
}

TEST(Interpolate, HoldsItsEnds) {
  const std::vector<double> t = {1, 2, 4};
  const std::vector<double> x = {10, 20, 0};
  EXPECT_EQ(interpolate(t, x, 0), 10);
  EXPECT_EQ(interpolate(t, x, 1.5), 15);
  EXPECT_EQ(interpolate(t, x, 3), 10);
  EXPECT_EQ(interpolate(t, x, 9), 0);
}

TEST(LeastSquares, LineAndCurveGoThroughWhatLiesOnThem) {
  std::vector<double> x;
  std::vector<double> line;
  std::vector<double> bent;
  for (int k = 0; k < 500; ++k) {
    x.push_back(300 + k % 250);
    line.push_back(5 + 0.3 * x.back());
    bent.push_back(0.001 * x.back() * x.back());
  }
  const std::vector<double> at = {310, 420, 540};
  const std::vector<double> curve = least_squares_curve(x, bent, at);
  for (std::size_t k = 0; k < at.size(); ++k) EXPECT_NEAR(curve[k], 0.001 * at[k] * at[k], 0.1);
  EXPECT_NEAR(least_squares_curve(x, line, {1000})[0], 5 + 0.3 * 549, 0.2) << "level beyond the readings";
  EXPECT_EQ(least_squares_curve({7, 7}, {3, 3}, {9}), std::vector<double>{3});
}

}  // namespace
}  // namespace flexor::score
