#include "host/camera/filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace flexor::camera {
namespace {

constexpr double kFrame_s = 1.0 / 30;

// What comes out for angle(t) with white noise, measured where seen(frame).
std::vector<FilteredRow> run(
    int frames, double sigma_deg, double given_sigma_deg, unsigned seed,
    const std::function<double(double)>& angle,
    const std::function<bool(int)>& seen = [](int) { return true; }) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  AngleFilter filter(1);
  std::vector<FilteredRow> out;
  for (int k = 0; k < frames; ++k) {
    Measurement m;
    const double noise = sigma_deg * normal(random);
    if (seen(k)) m.angle = Angle{angle(k * kFrame_s) + noise, given_sigma_deg * given_sigma_deg};
    if (auto row = filter.push(k * kFrame_s, {m})) out.push_back(*row);
  }
  for (FilteredRow& row : filter.flush()) out.push_back(row);
  return out;
}

double swing(double t) { return 50 + 40 * std::sin(2 * 3.14159 * 0.7 * t); }

TEST(Filter, GivesEveryFrameOnceInOrder) {
  const auto rows = run(40, 0, 0.1, 1, swing);
  ASSERT_EQ(rows.size(), 40U);
  for (std::size_t k = 0; k < rows.size(); ++k)
    EXPECT_NEAR(rows[k].t_s, static_cast<double>(k) * kFrame_s, 1e-12);
}

TEST(Filter, HasNoLagAndItsStandardErrorIsHonest) {
  int within_one = 0;
  int within_two = 0;
  int count = 0;
  double lagging = 0;
  double squares = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const FilteredRow& row : run(300, 0.5, 0.5, seed, swing)) {
      const double e = row.angles[0].deg - swing(row.t_s);
      squares += e * e;
      lagging += e * (swing(row.t_s + 0.01) - swing(row.t_s - 0.01));
      within_one += std::abs(e) < row.angles[0].se_deg ? 1 : 0;
      within_two += std::abs(e) < 2 * row.angles[0].se_deg ? 1 : 0;
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.45);
  EXPECT_NEAR(lagging / count, 0, 0.05);
  EXPECT_GT(within_one, 0.62 * count);
  EXPECT_LT(within_one, 0.82 * count);
  EXPECT_GT(within_two, 0.92 * count);
}

TEST(Filter, SmoothsAtRest) {
  double squares = 0;
  const auto rows = run(600, 0.3, 0.3, 1, [](double) { return 20.0; });
  for (const FilteredRow& row : rows) squares += std::pow(row.angles[0].deg - 20, 2);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(rows.size())), 0.2);
}

TEST(Filter, BridgesTenHiddenFramesWithAFlagAndCallsElevenLost) {
  const auto hidden = run(100, 0.05, 0.05, 1, swing, [](int k) { return k < 40 || k >= 50; });
  for (int k = 40; k < 50; ++k) {
    const FilteredAngle& a = hidden[static_cast<std::size_t>(k)].angles[0];
    EXPECT_EQ(a.quality, Quality::hidden);
    EXPECT_LT(std::abs(a.deg - swing(k * kFrame_s)), 4 * a.se_deg);
    EXPECT_LT(a.se_deg, 30);
  }
  EXPECT_EQ(hidden[50].angles[0].quality, Quality::good);
  const auto lost = run(100, 0.05, 0.05, 1, swing, [](int k) { return k < 40 || k >= 51; });
  for (int k = 40; k < 51; ++k) {
    EXPECT_EQ(lost[static_cast<std::size_t>(k)].angles[0].quality, Quality::lost) << k;
    EXPECT_EQ(lost[static_cast<std::size_t>(k)].angles[0].se_deg, 180);
  }
  EXPECT_EQ(lost[51].angles[0].quality, Quality::good);
}

TEST(Filter, IsLostUntilSomethingIsSeenAndForeverIfNothingIs) {
  const auto late = run(60, 0, 0.1, 1, swing, [](int k) { return k >= 30; });
  EXPECT_EQ(late[29].angles[0].quality, Quality::lost);
  EXPECT_EQ(late[30].angles[0].quality, Quality::good);
  for (const FilteredRow& row : run(30, 0, 0.1, 1, swing, [](int) { return false; }))
    EXPECT_EQ(row.angles[0].quality, Quality::lost);
}

TEST(Filter, AJumpIsFollowedInItsOwnFrame) {
  const auto step = [](double t) { return t < 1.5 ? 20.0 : 90.0; };
  for (const FilteredRow& row : run(90, 0.05, 0.05, 1, step))
    EXPECT_NEAR(row.angles[0].deg, step(row.t_s + 1e-9), 0.5) << row.t_s;
}

TEST(Filter, NoiseThatTheMarksDidNotAnnounceIsLearnt) {
  const auto rows = run(400, 0.6, 0.1, 1, [](double) { return 30.0; });
  double squares = 0;
  double estimate = 0;
  for (std::size_t k = 100; k < rows.size(); ++k) {
    squares += std::pow(rows[k].angles[0].deg - 30, 2);
    estimate += rows[k].angles[0].se_deg * rows[k].angles[0].se_deg;
  }
  EXPECT_GT(estimate / squares, 0.4);
  EXPECT_LT(estimate / squares, 3);
}

TEST(Filter, UnevenFramesAreTakenAtTheirOwnTimes) {
  AngleFilter filter(1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0.01, 0.08);
  std::vector<FilteredRow> rows;
  double t = 0;
  for (int k = 0; k < 200; ++k) {
    Measurement m;
    m.angle = Angle{100 * t, 0.01};
    if (auto row = filter.push(t, {m})) rows.push_back(*row);
    t += uniform(random);
  }
  for (const FilteredRow& row : rows) EXPECT_NEAR(row.angles[0].deg, 100 * row.t_s, 0.05);
}

}  // namespace
}  // namespace flexor::camera
