#include "host/recording/sensor_lag.hpp"

#include <gtest/gtest.h>

#include <random>

#include "host/recording/align.hpp"

namespace flexor::recording {
namespace {

struct Lagging {
  std::vector<double> sensor_t, sensor, camera_t, camera;
  double offset_s = 0;

  Series log() const { return {sensor_t, sensor}; }
  Series seen() const { return {camera_t, camera}; }
};

// A finger that goes to random angles at random speeds by the least jerk, through a play of the cloth and a lag of the
// sensor, in either order, and saturation. With `home_s` it goes back after each movement, and rests so long.
Lagging lagging(unsigned seed, double samples, double noise_counts, double correlation, double home_s = 0,
                double camera_hz = 30) {
  constexpr double kStep_s = 0.005;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  Lagging out;
  out.offset_s = 2 * uniform(random) - 1;
  const double tau_s = 0.3 * uniform(random);
  const double radius = 8 * uniform(random);
  const bool lag_last = uniform(random) < 0.5;
  double from = 28;
  double p = from;
  double y = from;
  double error = normal(random);
  double t = 0;
  while (static_cast<double>(out.sensor.size()) < samples) {
    const bool home = home_s > 0 && from != 28;
    const double to = home ? 28 : 28 + 85 * uniform(random);
    const double move_s = 0.4 + 1.1 * uniform(random);
    const double rest_s = home ? home_s : 0.8 * uniform(random);
    for (double s_s = 0; s_s < move_s + rest_s; s_s += kStep_s, t += kStep_s) {
      const double s = std::min(1.0, s_s / move_s);
      const double angle = from + (to - from) * s * s * s * (10 - 15 * s + 6 * s * s);
      const double into_play = lag_last ? angle : y;
      p = std::min(into_play + radius, std::max(into_play - radius, p));
      y += ((lag_last ? p : angle) - y) * (tau_s > 0 ? 1 - std::exp(-kStep_s / tau_s) : 1);
      if (t >= static_cast<double>(out.sensor_t.size()) * 0.05) {
        error = correlation * error + std::sqrt(1 - correlation * correlation) * normal(random);
        out.sensor_t.push_back(t);
        out.sensor.push_back(
            std::round(300 + 400 * std::tanh(((lag_last ? y : p) - 28) / 70) + noise_counts * error));
      }
      if (t >= static_cast<double>(out.camera_t.size()) / camera_hz) {
        out.camera_t.push_back(t + out.offset_s);
        out.camera.push_back(angle + 0.3 * normal(random));
      }
    }
    from = to;
  }
  return out;
}

class Noise : public testing::TestWithParam<double> {};

// 3000 samples, 1 % noise, white and in runs.
TEST_P(Noise, TheOffsetIsTheClocksAndNotTheSensorsLag) {
  int near = 0;
  int covered = 0;
  int near_with_lag = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Lagging logs = lagging(seed, 3000, 4, GetParam());
    const Alignment a = align(logs.log(), logs.seen());
    ASSERT_TRUE(a.clock_offset_se_s && a.sensor_lag_s) << seed;
    const double error_s = a.clock_offset_s - logs.offset_s;
    near += std::abs(error_s) < 0.05;
    near_with_lag += std::abs(error_s - *a.sensor_lag_s) < 0.05;
    covered += std::abs(error_s) < 1.96 * *a.clock_offset_se_s;
  }
  EXPECT_GE(near, 95);
  EXPECT_LT(near_with_lag, 20) << "the velocities alone";
  EXPECT_GE(covered, 90);
  EXPECT_LE(covered, 98);
}

INSTANTIATE_TEST_SUITE_P(SensorLag, Noise, testing::Values(0, 0.95));

// Two joints bend one sensor: each alone would ask for an offset of its own.
TEST(SensorLag, JointsOfOneSensorShareItsClock) {
  Lagging logs = lagging(7, 3000, 4, 0);
  const Lagging other = lagging(8, 3000, 0, 0);
  const std::size_t frames = std::min(logs.camera.size(), other.camera.size());
  std::vector<double> second(other.camera.begin(),
                             other.camera.begin() + static_cast<std::ptrdiff_t>(frames));
  const double shift_s = logs.offset_s - other.offset_s;
  std::size_t at = 0;
  for (std::size_t k = 0; k < logs.sensor.size(); ++k) {
    while (at + 1 < frames && logs.camera_t[at + 1] - logs.offset_s < logs.sensor_t[k]) ++at;
    logs.sensor[k] += 1.5 * second[at];
  }
  std::vector<double> t(other.camera_t.begin(), other.camera_t.begin() + static_cast<std::ptrdiff_t>(frames));
  for (double& value : t) value += shift_s;
  const auto both = sensor_lag(logs.log(), {logs.seen(), {t, second}}, logs.offset_s);
  ASSERT_TRUE(both);
  EXPECT_NEAR(both->clock_offset_s, logs.offset_s, 0.04);
}

// A finger that rests nine tenths of the time, before a slow camera: its motion is no outlier.
TEST(SensorLag, RestTellsNothingAndHidesNothing) {
  for (const double camera_hz : {5, 30}) {
    for (unsigned seed = 0; seed < 6; ++seed) {
      const Lagging logs = lagging(seed, 6000, 1, 0, 12, camera_hz);
      const Alignment a = align(logs.log(), logs.seen());
      ASSERT_TRUE(a.clock_offset_se_s) << seed;
      EXPECT_NEAR(a.clock_offset_s, logs.offset_s, 0.125) << camera_hz << " Hz, seed " << seed;
    }
  }
}

// An outlier, and readings where no camera looked, tell nothing.
TEST(SensorLag, SpikesAndWhatNobodySawChangeNothing) {
  const Lagging logs = lagging(3, 3000, 4, 0);
  Lagging worse = logs;
  for (std::size_t k = 100; k < worse.sensor.size(); k += 300) worse.sensor[k] = 1e6;
  const auto clean = sensor_lag(logs.log(), {logs.seen()}, logs.offset_s + 0.2);
  const auto spiked = sensor_lag(worse.log(), {worse.seen()}, logs.offset_s + 0.2);
  ASSERT_TRUE(clean && spiked);
  EXPECT_NEAR(spiked->clock_offset_s, clean->clock_offset_s, 0.003);
  const Series late{logs.seen().t_s.subspan(1000), logs.seen().value.subspan(1000)};
  const auto part = sensor_lag(logs.log(), {late}, logs.offset_s);
  ASSERT_TRUE(part);
  EXPECT_NEAR(part->clock_offset_s, logs.offset_s, 3 * part->standard_error_s);
  EXPECT_FALSE(sensor_lag(logs.log(), {logs.seen()}, logs.offset_s + 1000)) << "nothing in common";
}

}  // namespace
}  // namespace flexor::recording
