#include "host/recording/taps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "host/recording/align.hpp"

namespace flexor::recording {
namespace {

struct Log {
  std::vector<double> t_s;
  std::vector<double> value;
  operator Series() const { return {t_s, value}; }
};

// From rest: three bends `apart_s` from one another from 4 s on, then the same slow move again and again.
double tapped_motion(double t, double apart_s) {
  const double in_bend = (t - 4) / apart_s;
  if (in_bend >= 0 && in_bend < 3) return 30 + 50 * std::pow(std::sin(M_PI * in_bend), 2);
  return t < 4 + 3 * apart_s + 3 ? 30 : 60 - 30 * std::cos(2 * M_PI * (t - 4 - 3 * apart_s - 3) / 6);
}

Log seen(const std::function<double(double)>& angle, double from_s, double to_s, double rate_hz,
         double offset_s, unsigned seed, double gain = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.5);
  Log out;
  for (double t = from_s; t < to_s; t += 1 / rate_hz) {
    out.t_s.push_back(t + offset_s);
    out.value.push_back(gain * (angle(t) + noise(random)));
  }
  return out;
}

TEST(Taps, AreFoundWhereTheyAreWhicheverWayTheSensorReads) {
  for (const double apart_s : {0.4, 0.8, 1.3}) {
    for (const double gain : {1.0, -4.0}) {
      const auto found =
          taps(seen([&](double t) { return tapped_motion(t, apart_s); }, 0, 60, 30, 100, 1, gain));
      ASSERT_TRUE(found) << apart_s << ' ' << gain;
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR((*found)[static_cast<std::size_t>(k)], 104 + (k + 0.5) * apart_s, 0.1)
            << apart_s << ' ' << gain;
    }
  }
}

TEST(Taps, AreNotFoundWhereNobodyTapped) {
  const auto found = [](const std::function<double(double)>& angle) {
    return taps(seen(angle, 0, 60, 30, 0, 2)).has_value();
  };
  EXPECT_FALSE(found([](double t) { return 60 - 30 * std::cos(2 * M_PI * t / 6); }));
  EXPECT_FALSE(found([](double t) { return 60 - 30 * std::cos(2 * M_PI * t); })) << "quick all the time";
  EXPECT_FALSE(found([](double) { return 30.0; }));
  EXPECT_FALSE(found([](double t) { return tapped_motion(t < 30 ? t : t - 30, 0.5); })) << "tapped twice";
  EXPECT_FALSE(found([](double t) {
    return t < 4 ? 30 + 12 * std::sin(3 * (t - 4)) : tapped_motion(t, 0.5);
  })) << "no rest before";
}

// A script that repeats every six seconds: the signals alone cannot tell which repetition is which.
TEST(Taps, TellWhichRepetitionIsWhich) {
  int right = 0;
  int right_without = 0;
  constexpr int kPairs = 20;
  for (unsigned seed = 0; seed < kPairs; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> cut(0, 2);
    const double offset_s = std::uniform_real_distribution<double>(-20, 20)(random);
    const auto angle = [](double t) { return tapped_motion(t, 0.6); };
    const auto untapped = [](double t) { return tapped_motion(t < 5.8 ? 0 : t, 0.6); };
    const double begin = cut(random);
    // The reference ends early, so that a wrong repetition has as much overlap.
    const Alignment tapped =
        align(seen(angle, begin, 70, 20, 0, seed, 3), seen(angle, 0, 60, 30, offset_s, seed + 100));
    EXPECT_TRUE(tapped.tapped) << seed;
    right += std::abs(tapped.clock_offset_s - offset_s) < 0.05 && tapped.confidence > 0.5;
    const Alignment plain = align(seen(untapped, begin + 12, 70, 20, 0, seed, 3),
                                  seen(untapped, 12, 60, 30, offset_s, seed + 100));
    EXPECT_FALSE(plain.tapped) << seed;
    right_without += std::abs(plain.clock_offset_s - offset_s) < 0.05 && plain.confidence > 0.5;
  }
  EXPECT_EQ(right, kPairs);
  EXPECT_EQ(right_without, 0);
}

}  // namespace
}  // namespace flexor::recording
