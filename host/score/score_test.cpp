#include "host/score/score.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

std::vector<double> grid(std::size_t n, double period_s) {
  std::vector<double> t(n);
  for (std::size_t k = 0; k < n; ++k) t[k] = static_cast<double>(k) * period_s;
  return t;
}

std::vector<double> values(std::vector<double> t, const std::function<double(double)>& at) {
  std::ranges::transform(t, t.begin(), at);
  return t;
}

double swing(double t_s) { return 50 + 40 * std::sin(t_s); }

// `more` of each value of swing.
std::vector<double> swing_and(const std::vector<double>& t, const std::function<double()>& more) {
  return values(t, [&](double at) { return swing(at) + more(); });
}

TEST(Score, ClosedFormsOfAConstantError) {
  const auto t = grid(101, 0.1);
  const auto y = values(grid(101, 1), [](double k) { return std::fmod(k, 2) == 0 ? 10 : 30; });
  const Score s = score(t, y, values(y, [](double at) { return at + 3; }));
  EXPECT_DOUBLE_EQ(s.rmse_deg, 3);
  EXPECT_DOUBLE_EQ(s.max_abs_deg, 3);
  EXPECT_DOUBLE_EQ(s.p95_abs_deg, 3);
  EXPECT_NEAR(s.iae_deg_s, 30, 1e-9);
  EXPECT_NEAR(s.r2, 1 - 9.0 / 100, 1e-3);
  EXPECT_NEAR(s.fit_percent, 100 * (1 - 3.0 / 10), 0.1);
  EXPECT_EQ(s.samples, 101u);
  const std::vector<double> still(10, 0.1);  // its mean is rounded
  EXPECT_TRUE(std::isnan(score(grid(10, 0.1), still, std::vector<double>(10, 6)).r2));
}

TEST(Score, FindsAndRemovesAConstantLag) {
  const auto t = grid(2000, 0.05);
  const auto motion = [](double at) { return swing(2 * std::numbers::pi * at / 7); };
  for (const double lag : {-0.31, 0.0, 0.02, 0.4}) {
    const Score s = score(t, values(t, motion), values(t, [&](double at) { return motion(at - lag); }));
    EXPECT_NEAR(s.best_lag_s, lag, 0.005);
    EXPECT_LT(s.lag_removed_rmse_deg, 0.6);  // the ends have nothing to be compared with
    EXPECT_TRUE(lag == 0 || s.rmse_deg > s.lag_removed_rmse_deg) << lag;
  }
}

TEST(Score, ACausalDelayCostsDistanceTimesLag) {
  // One 85-degree move at any speed, seen tau late: the integral of the absolute error is 85 tau.
  const auto t = grid(1001, 0.01);
  const auto y = values(t, [](double at) { return 85 * std::clamp(at - 4, 0.0, 1.0); });
  const auto late = values(t, [](double at) { return 85 * std::clamp(at - 4.1, 0.0, 1.0); });
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
    RC_PRE(std::ranges::max(y) > std::ranges::min(y));
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
    const Score s = score(t, values(t, swing), swing_and(t, [&] { return noise(random); }));
    EXPECT_NEAR(s.best_lag_s, 0, 0.01);
    EXPECT_NEAR(s.lag_removed_rmse_deg, s.rmse_deg, 0.02 * s.rmse_deg);
  }
}

TEST(Score, ALagOutsideTheSearchIsAtItsEdge) {
  const auto t = grid(4000, 0.05);
  for (const double lag : {0.9, 1.01, 1.2, -1.05}) {
    const auto late = values(t, [&](double at) { return swing(2 * (at - lag)); });
    const Score s = score(t, values(t, [](double at) { return swing(2 * at); }), late);
    EXPECT_EQ(s.lag_at_edge, std::abs(lag) > 1) << lag;
  }
}

TEST(Compare, WhatLiesInAGapOfTheMeasuredAngleIsLeftOutAndCounted) {
  const auto t = grid(1200, 0.05);
  auto measured_t = t;
  std::erase_if(measured_t, [](double at) { return at > 10.01 && at < 49.99; });
  const auto estimate = swing_and(t, [] { return 1; });
  const Score s = compare({measured_t, values(measured_t, swing), 0.3}, {t, estimate, 0.3});
  EXPECT_NEAR(s.rmse_deg, 1, 1e-9);
  EXPECT_EQ(s.samples + s.left_out, 1200u);
  EXPECT_EQ(s.left_out, 799u);
  EXPECT_EQ(compare({t, estimate, 0.3}, {measured_t, values(measured_t, swing), 0.3}).left_out, 799u);
  EXPECT_NEAR(s.iae_deg_s, 10 + 9.95, 0.01);  // nothing is known of the forty seconds between
}

TEST(Compare, EveryRowOfABurstCounts) {
  const auto t = grid(400, 0.05);
  const auto y = values(t, swing);
  std::vector<double> twice_t;
  std::vector<double> twice;
  for (std::size_t k = 0; k < t.size(); ++k) {
    twice_t.insert(twice_t.end(), {t[k], t[k]});
    twice.insert(twice.end(), {y[k], y[k] + 10});
  }
  EXPECT_NEAR(compare({t, y}, {twice_t, twice}).rmse_deg, std::sqrt(50.0), 1e-9);
  EXPECT_NEAR(compare({twice_t, twice}, {t, y}).rmse_deg, 5, 1e-9);
}

TEST(Score, ThePercentileAndTheIntegralWithoutTheLagAreWhatTheyAreCalled) {
  const auto t = grid(1001, 0.01);
  const auto y = values(t, swing);
  const auto all =
      swing_and(t, [k = 0]() mutable { return (k++ * 617) % 1001 / 100.0; });  // errors from 0 to 10
  EXPECT_NEAR(score(t, y, all).p95_abs_deg, 9.5, 0.02);
  const Score s = score(t, y, values(t, [](double at) { return swing(at - 0.2) + 3; }));
  EXPECT_NEAR(s.lag_removed_iae_deg_s, 3 * 9.8, 0.5);
  EXPECT_GT(s.iae_deg_s, s.lag_removed_iae_deg_s + 1);
}

TEST(Compare, LessThanASecondIsNoComparison) {
  const auto t = grid(100, 0.05);
  const auto later = [&](double by_s) { return values(t, [=](double at) { return at + by_s; }); };
  EXPECT_THROW((void)compare({t, t}, {later(4.2), t}), io::InputError);
  EXPECT_NO_THROW((void)compare({t, t}, {later(2.2), t}));
  EXPECT_THROW((void)compare({t, std::vector<double>(100, 7)}, {t, t}), io::JobError) << "nothing moved";
}

// Whatever stands where nothing was measured.
TEST(Score, WhatWasNotSeenIsNotScored) {
  const auto t = grid(400, 0.05);
  const auto estimated = swing_and(t, [k = 0]() mutable { return k++ % 2 == 0 ? 1 : -1; });
  auto measured = values(t, swing);
  std::fill(measured.begin() + 100, measured.begin() + 200, 1000);
  std::vector<std::uint8_t> unseen(400, 0);
  std::fill(unseen.begin() + 100, unseen.begin() + 200, 1);
  const Score s = score_seen(t, measured, estimated, unseen);
  EXPECT_NEAR(s.rmse_deg, 1, 1e-9);
  EXPECT_EQ(s.left_out, 100U);
  EXPECT_EQ(s.samples, 300U);
  ASSERT_TRUE(in_words_left_out(s.left_out, s.samples + s.left_out, "scored"));
  EXPECT_NE(in_words_left_out(s.left_out, s.samples + s.left_out, "scored")->find("25 %"), std::string::npos);
  EXPECT_GT(score(t, measured, estimated).rmse_deg, 100);
}

}  // namespace
}  // namespace flexor::score
