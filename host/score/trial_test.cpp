#include "host/score/trial.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

constexpr double kPeriod_s = 1.0 / 30;

// 30 to 110 degrees between 2 s and 3 s, `lag_s` late, over 6 s.
std::vector<float> ramp(double lag_s) {
  std::vector<float> out;
  for (int k = 0; k <= 180; ++k)
    out.push_back(static_cast<float>(30 + 80 * std::clamp(k * kPeriod_s - lag_s - 2.0, 0.0, 1.0)));
  return out;
}

const std::vector<std::vector<float>> kReference = {ramp(0)};

TEST(Trial, APureLagCostsTravelTimesLagAndNothingOnceItIsRemoved) {
  const std::vector<std::vector<float>> reference = {ramp(0), ramp(0)};
  const std::vector<std::vector<float>> hand = {ramp(0.1), ramp(0.1)};
  const TrialScore s = score_trial(reference, hand, kPeriod_s);
  EXPECT_NEAR(s.total_error_deg_s, 2 * 80 * 0.1, 0.01);
  EXPECT_NEAR(s.finger_error_deg_s[1], 80 * 0.1, 0.005);
  ASSERT_TRUE(s.lag_removed);
  EXPECT_NEAR(s.lag_removed->lag_s, 0.1, 0.0026);
  EXPECT_LT(s.lag_removed->total_error_deg_s, 0.6);
}

TEST(Trial, AConstantErrorIsNoLag) {
  std::vector<std::vector<float>> hand = kReference;
  for (float& angle : hand[0]) angle += 2;
  const TrialScore s = score_trial(kReference, hand, kPeriod_s);
  EXPECT_NEAR(s.total_error_deg_s, 12, 1e-3);
  // A lag can make up for two degrees of the one second that moves, no more.
  ASSERT_TRUE(s.lag_removed);
  EXPECT_GT(s.lag_removed->total_error_deg_s, 9.9);
}

// What would get better still beyond the search has no best lag, on either side; just inside it has one.
TEST(Trial, ALagAtTheEdgeOfTheSearchIsNone) {
  for (const double lag_s : {-0.4, -0.2, -0.19, 0.59, 0.6, 0.9}) {
    const std::vector<std::vector<float>> hand = {ramp(lag_s)};
    const TrialScore s = score_trial(kReference, hand, kPeriod_s);
    EXPECT_EQ(s.lag_removed.has_value(), lag_s > -0.195 && lag_s < 0.595) << lag_s;
    EXPECT_NEAR(s.total_error_deg_s, 80 * std::abs(lag_s), 0.1);
    EXPECT_NEAR(s.lag_removed ? s.lag_removed->lag_s : lag_s, lag_s, 0.0026);
  }
}

TEST(Trial, RefusesSeriesThatDoNotBelongTogether) {
  const std::vector<std::vector<float>> shorter = {{1, 2, 3}};
  EXPECT_THROW((void)score_trial(kReference, shorter, kPeriod_s), io::JobError);
  EXPECT_THROW((void)score_trial({}, {}, kPeriod_s), io::JobError);
}

}  // namespace
}  // namespace flexor::score
