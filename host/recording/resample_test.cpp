#include "host/recording/resample.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace flexor::recording {
namespace {

TEST(Resample, AStraightLineStaysAStraightLine) {
  std::vector<double> t;
  std::vector<double> x;
  for (int i = 0; i < 200; ++i) {
    t.push_back(i * 0.11 + (i % 3) * 0.015);
    x.push_back(3 * t.back() - 5);
  }
  const auto r = resample({t, x}, {1, 0.01, 1500}, 1);
  const Grid grid{1, 0.01, 1500};
  for (std::size_t k = 0; k < grid.size; ++k) {
    EXPECT_NEAR(r.value[k], 3 * grid.time(k) - 5,
                3 * 0.005 + 1e-9);  // a cell's mean may lie half a cell away
    EXPECT_EQ(r.gap[k], 0);
  }
}

TEST(Resample, ABurstBecomesItsMean) {
  const std::vector<double> t = {0, 0.99, 1.0, 1.01, 2};
  const std::vector<double> x = {0, 3, 6, 9, 0};
  EXPECT_DOUBLE_EQ(resample({t, x}, {1, 0.1, 1}, 5).value[0], 6);
}

TEST(Resample, APauseIsMarkedAndBridged) {
  const std::vector<double> t = {0, 0.1, 0.2, 2.2, 2.3, 2.4};
  const std::vector<double> x = {1, 1, 1, 3, 3, 3};
  const auto r = resample({t, x}, {0, 0.1, 25}, 0.5);
  EXPECT_EQ(r.gap[1], 0);
  EXPECT_EQ(r.gap[10], 1);
  EXPECT_NEAR(r.value[12], 2, 1e-9);
  EXPECT_EQ(r.gap[23], 0);
}

TEST(Resample, OutsideTheRecordingIsAGap) {
  const std::vector<double> t = {1, 2};
  const std::vector<double> x = {5, 6};
  const auto r = resample({t, x}, {-1, 0.5, 10}, 5);
  EXPECT_EQ(r.gap.front(), 1);
  EXPECT_EQ(r.value.front(), 5);
  EXPECT_EQ(r.gap.back(), 1);
  EXPECT_EQ(r.value.back(), 6);
}

TEST(Resample, NeverLeavesTheRangeOfTheSamples) {
  EXPECT_TRUE(rc::check([](const std::vector<std::pair<uint8_t, int8_t>>& samples) {
    RC_PRE(!samples.empty());
    std::vector<double> t;
    std::vector<double> x;
    double now = 0;
    for (const auto& [step, value] : samples) {
      now += 0.01 + step / 100.0;
      t.push_back(now);
      x.push_back(value);
    }
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    for (const double v : resample({t, x}, {-1, 0.07, 500}, 0.5).value) {
      RC_ASSERT(v >= *low - 1e-9);
      RC_ASSERT(v <= *high + 1e-9);
    }
  }));
}

TEST(SinceStart, DoesNotDependOnWhereTheClockStarted) {
  std::vector<double> t;
  std::vector<double> shifted;
  for (int ms = 17823; ms < 20000; ms += 37) {
    t.push_back(ms * 1e-3);
    shifted.push_back((ms - 300000) * 1e-3);
  }
  EXPECT_EQ(since_start(t), since_start(shifted));
}

TEST(DefaultMaxGap, FollowsTheLogsOwnPace) {
  std::vector<double> t;
  for (int i = 0; i < 10; ++i) t.push_back(i * 0.5);
  EXPECT_DOUBLE_EQ(default_max_gap_s(t), 2.5);
  for (double& v : t) v /= 50;
  EXPECT_DOUBLE_EQ(default_max_gap_s(t), 0.3);
}

}  // namespace
}  // namespace flexor::recording
