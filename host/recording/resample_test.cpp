#include "host/recording/resample.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace flexor::recording {
namespace {

TEST(Resample, ALogAtTheGridsOwnPaceGoesThroughReadingByReading) {
  // Whole milliseconds at 30 Hz: 33, 67, 100; no reading may come a sample late.
  std::vector<double> t;
  std::vector<double> x;
  for (int k = 0; k < 600; ++k) {
    t.push_back(17 + std::round(1000.0 * k / 30) / 1000);
    x.push_back(k);
  }
  const Samples s = resample({t, x}, 1.0 / 30, 0.3);
  EXPECT_EQ(s.value, x);
}

TEST(Resample, EachReadingOfALiveLogIsAnsweredAtOnce) {
  Resampler resampler({Range{}}, 0.1, 0.3);
  for (int k = 0; k < 60; ++k) {
    const double value = k;
    std::size_t answers = 0;
    resampler.push(0.1 * k, {&value, 1}, [&](const Sample& s) {
      ++answers;
      EXPECT_EQ(s.value[0], k);
      EXPECT_NEAR(s.t_s, 0.1 * k, 1e-9);
    });
    EXPECT_EQ(answers, 1u) << k;
  }
}

TEST(Resample, AFasterLogIsAveragedAndASlowerOneHeld) {
  std::vector<double> t;
  std::vector<double> x;
  for (int k = 0; k <= 100; ++k) {
    t.push_back(0.01 * k);
    x.push_back(k);
  }
  const Samples fast = resample({t, x}, 0.05, 0.3);
  ASSERT_EQ(fast.value.size(), 21u);
  EXPECT_DOUBLE_EQ(fast.value[0], 0);
  EXPECT_DOUBLE_EQ(fast.value[1], 3);    // 1 2 3 4 5
  EXPECT_DOUBLE_EQ(fast.value[20], 98);  // 96 .. 100
  const std::vector<double> slow_t = {0, 0.5, 1};
  const std::vector<double> slow_x = {1, 2, 3};
  const Samples slow = resample({slow_t, slow_x}, 0.05, 2.5);
  ASSERT_EQ(slow.value.size(), 21u);
  for (std::size_t k = 0; k < 21; ++k) EXPECT_EQ(slow.value[k], k < 10 ? 1 : k < 20 ? 2 : 3) << k;
  for (const auto pause : slow.pause) EXPECT_EQ(pause, 0);
}

TEST(Resample, WhatComesLaterChangesNothing) {
  EXPECT_TRUE(rc::check([](const std::vector<std::pair<uint8_t, int8_t>>& steps) {
    RC_PRE(steps.size() > 3u);
    std::vector<double> t;
    std::vector<double> x;
    double now = 0;
    for (const auto& [step, value] : steps) {
      now += step / 500.0;
      t.push_back(now);
      x.push_back(value);
    }
    const Samples before = resample({t, x}, 0.05, 0.3);
    const std::size_t cut = t.size() / 2;
    for (std::size_t i = cut; i < x.size(); ++i) x[i] = 1000 - x[i];
    const Samples after = resample({t, x}, 0.05, 0.3);
    RC_ASSERT(before.t_s == after.t_s);
    for (std::size_t k = 0; k < before.t_s.size() && before.t_s[k] + Resampler::kTolerance_s < t[cut]; ++k)
      RC_ASSERT(before.value[k] == after.value[k]);
  }));
}

TEST(Resample, APauseIsHeldAndMarkedAndALongOneStartsAgain) {
  const std::vector<double> t = {0, 0.1, 0.2, 2.2, 2.3, 60, 60.1};
  const std::vector<double> x = {1, 1, 2, 3, 3, 9, 9};
  const Samples s = resample({t, x}, 0.1, 0.5);
  ASSERT_EQ(s.t_s.size(), 24u + 2u);
  EXPECT_EQ(s.pause[6], 0);  // 0.6 s: 0.4 s after the newest reading
  EXPECT_EQ(s.pause[8], 1);
  EXPECT_EQ(s.value[21], 2);  // held until the next reading
  EXPECT_EQ(s.value[22], 3);
  EXPECT_EQ(s.pause[22], 0);
  EXPECT_DOUBLE_EQ(s.t_s[24], 60);
  EXPECT_EQ(s.value[24], 9);
}

TEST(Resample, NeverLeavesTheRangeOfTheReadingsAndNeverGrowsBeyondThem) {
  EXPECT_TRUE(rc::check([](const std::vector<std::pair<uint16_t, int8_t>>& readings) {
    RC_PRE(!readings.empty());
    std::vector<double> t;
    std::vector<double> x;
    double now = 1e9;
    for (const auto& [step, value] : readings) {
      now += step / 10.0;  // up to 6553 s
      t.push_back(now);
      x.push_back(value);
    }
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    const Samples s = resample({t, x}, 0.07, 0.5);
    RC_ASSERT(s.value.size() <= x.size() * 144);  // ten seconds' worth for each reading
    for (const double v : s.value) RC_ASSERT(v >= *low - 1e-9 && v <= *high + 1e-9);
  }));
}

TEST(WithoutJumps, LeavesOutWhatATrackerSaysThatLostItsMarkAndNoMotion) {
  std::vector<double> t, x;
  for (int k = 0; k < 900; ++k) {
    t.push_back(k / 30.0);
    x.push_back(45 - 45 * std::cos(6 * t.back()) + 0.3 * std::sin(91.0 * k));  // up and down once a second
  }
  EXPECT_EQ(std::ranges::count(without_jumps({t, x}), 0), 0);
  std::vector<double> taps = x;  // quick ones of a finger at rest
  for (std::size_t k = 0; k < taps.size(); ++k)
    taps[k] = 35 * std::max(0.0, 1 - std::abs(std::fmod(t[k], 1.003) - 0.5) / 0.08);
  EXPECT_EQ(std::ranges::count(without_jumps({t, taps}), 0), 0);
  for (const std::size_t lost : {47U, 78U, 79U, 110U}) x[lost] = 0;
  const std::vector<std::uint8_t> kept = without_jumps({t, x});
  EXPECT_EQ(std::ranges::count(kept, 0), 4);
  EXPECT_EQ(kept[47] + kept[78] + kept[79] + kept[110], 0);
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

TEST(DefaultMaxGap, FollowsTheLogsOwnPaceAndNeitherABurstNorAPauseIsOne) {
  const auto max_gap_s = [](int rows, const std::function<double(int)>& at_s) {
    std::vector<double> t;
    for (int k = 0; k < rows; ++k) t.push_back(at_s(k));
    return default_max_gap_s(t);
  };
  EXPECT_DOUBLE_EQ(max_gap_s(10, [](int k) { return 0.5 * k; }), 2.5);
  EXPECT_DOUBLE_EQ(max_gap_s(10, [](int k) { return 0.5 * k / 50; }), 0.3);
  EXPECT_NEAR(max_gap_s(120, [](int k) { return 0.5 * (k / 3) + 0.01 * (k % 3); }), 5 * 0.48, 1e-9);
  EXPECT_NEAR(max_gap_s(80, [](int k) { return 0.5 * (k / 2); }), 2.5, 1e-9);
  const auto pauses = [](int k) { return 0.1 * k + 3 * (k / 40) + (k >= 200 ? 1e5 : 0); };
  EXPECT_NEAR(max_gap_s(400, pauses), 0.5, 1e-9);
  const auto hole = [&](int k) { return k == 99 ? pauses(198) + 10 : pauses(100 + k); };
  EXPECT_NEAR(max_gap_s(100, hole), 0.5, 1e-9) << "as long as all the rest and more";
}

TEST(Resample, AReadingOutOfItsRangeStandsOnlyWhereThereIsNoOther) {
  const std::vector<double> t = {0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.2};
  const std::vector<double> x = {5, 1023, 6, 0, 8, 1023, 1023};
  const Samples s = resample({t, x}, 0.1, 0.5, {1, 1022});
  ASSERT_EQ(s.value.size(), 3u);
  EXPECT_EQ(s.value[0], 5);
  EXPECT_EQ(s.value[1], 7);
  EXPECT_EQ(s.value[2], 1023);
}

}  // namespace
}  // namespace flexor::recording
