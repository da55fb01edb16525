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

}  // namespace
}  // namespace flexor::identify
