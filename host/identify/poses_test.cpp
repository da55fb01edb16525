#include "host/identify/poses.hpp"

#include <gtest/gtest.h>

namespace flexor::identify {
namespace {

// A sensor that falls from 700 to 300 while the angle goes from 10 to 90 degrees and back.
Session bends(double spike = 0) {
  Session s;
  constexpr Eigen::Index kSamples = 400;
  s.angle_deg.resize(kSamples);
  s.input.resize(kSamples, 2);
  s.use.assign(kSamples, 1);
  for (Eigen::Index k = 0; k < kSamples; ++k) {
    const double closed = 0.5 - 0.5 * std::cos(0.1 * static_cast<double>(k));
    s.angle_deg(k) = 10 + 80 * closed;
    s.input(k, 0) = 700 - 400 * closed;
    s.input(k, 1) = 500;
  }
  s.input(5, 0) += spike;
  return s;
}

TEST(Poses, AreTheReadingsAtTheEndsOfTheAnglesWhateverASpikeSays) {
  for (const double spike : {0.0, 5000.0}) {
    const auto poses = poses_of({bends(spike)}, 0);
    ASSERT_TRUE(poses);
    EXPECT_NEAR(poses->open, 692, 8);
    EXPECT_NEAR(poses->fist, 308, 8);
  }
}

TEST(Poses, AreNoneWhereTheSensorSaysNothingOrAPoseIsMissing) {
  EXPECT_FALSE(poses_of({bends()}, 1));
  Session few = bends();
  for (std::size_t k = 8; k < few.use.size(); ++k) few.use[k] = 0;
  EXPECT_FALSE(poses_of({few}, 0));
  EXPECT_FALSE(poses_of({}, 0));
}

TEST(Readings, SpreadAsTheSensorReadWhateverASpikeSays) {
  const auto readings = readings_of({bends(5000)}, 0);
  ASSERT_TRUE(readings);
  EXPECT_NEAR(readings->reading.front(), 300, 5);
  EXPECT_NEAR(readings->reading.back(), 700, 5);
  EXPECT_NEAR(readings->reading[2], 500, 20);
  EXPECT_FALSE(readings_of({bends()}, 1)) << "it never moved";
}

TEST(Readings, OfSeveralSessionsSayHowDonningsDiffer) {
  Session shifted = bends();
  shifted.input.array() += 40;
  EXPECT_FALSE(donning_spread({bends()}, 0));
  const auto spread = donning_spread({bends(), shifted}, 0);
  ASSERT_TRUE(spread);
  EXPECT_EQ(spread->recordings, 2);
  EXPECT_NEAR(spread->shift_sd, 40 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(spread->log_gain_sd, 0, 1e-9);
}

}  // namespace
}  // namespace flexor::identify
