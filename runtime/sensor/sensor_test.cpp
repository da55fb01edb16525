#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "runtime/sensor/calibration.hpp"
#include "runtime/sensor/guard.hpp"
#include "runtime/sensor/monitor.hpp"

namespace flexor::sensor {
namespace {

constexpr MonitorSettings kTenHertz = {2, 1020, 2, 5};  // 10 Hz: 0.2 s on a rail, 0.5 s of the same
constexpr GuardSettings kGuard = {29 * 16, 8 * 16, 3};

TEST(Calibration, RunsThroughItsKnotsAndStraightInBetween) {
  Calibration c{};
  for (int i = 0; i < kKnots; ++i) c.alpha[i] = static_cast<int16_t>(32 * i - 400);
  EXPECT_EQ(c(0), -400);
  EXPECT_EQ(c(16), -368);
  EXPECT_EQ(c(24), -352);
  EXPECT_EQ(c(1023), 1646);
  EXPECT_EQ(c(65535), c(1023));
}

TEST(Calibration, FollowsTheArticlesDividerWithinACountOverTheHandsRange) {
  Calibration c{};
  const auto bend = [](double n) { return (35 * n / (1023 - n) - 25) / (100.0 / 180); };
  for (int i = 0; i < kKnots; ++i)
    c.alpha[i] =
        static_cast<int16_t>(std::lround(32 * std::clamp(bend(std::min(16.0 * i, 1022.0)), -1000.0, 1000.0)));
  for (uint16_t n = 448; n <= 800; ++n) EXPECT_NEAR(c(n) / 32.0, bend(n), 0.36) << n;
}

RC_GTEST_PROP(Calibration, StaysBetweenItsKnots, ()) {
  Calibration c{};
  for (int16_t& alpha : c.alpha) alpha = *rc::gen::arbitrary<int16_t>();
  const auto n = *rc::gen::inRange<uint16_t>(0, 1024);
  const auto [low, high] = std::minmax(c.alpha[n / 16], c.alpha[n / 16 + 1]);
  RC_ASSERT(c(n) >= low);
  RC_ASSERT(c(n) <= high);
}

TEST(Monitor, FindsEveryFaultWithinHalfASecondAndForgetsIt) {
  for (const auto& [reading, expected] :
       {std::pair{1023, Health::open}, std::pair{0, Health::short_circuit}, std::pair{512, Health::stuck}}) {
    Monitor monitor;
    for (int k = 0; k < 20; ++k)
      EXPECT_EQ(monitor.step(kTenHertz, static_cast<uint16_t>(500 + k % 2)), Health::ok);
    Health health = Health::ok;
    for (int k = 0; k < 5; ++k) health = monitor.step(kTenHertz, static_cast<uint16_t>(reading));
    EXPECT_EQ(health, expected);
    for (int k = 0; k < 300; ++k) health = monitor.step(kTenHertz, static_cast<uint16_t>(reading));
    EXPECT_EQ(health, expected);
    EXPECT_EQ(monitor.step(kTenHertz, 505), Health::ok);
  }
}

TEST(Monitor, ForgivesAScratch) {
  Monitor monitor;
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(monitor.step(kTenHertz, static_cast<uint16_t>(k % 3 == 0 ? 1023 : 500 + k % 2)), Health::ok);
  }
}

TEST(Guard, HoldsThenRestsThenComesBackWithoutAJump) {
  Guard guard;
  guard.reset(kGuard);
  for (int k = 0; k < 20; ++k) (void)guard.step(kGuard, true, 100 * 16);
  EXPECT_EQ(guard.step(kGuard, true, 0), 0) << "no dead sensor: as far as it goes, at once";
  for (int k = 0; k < 3; ++k) EXPECT_EQ(guard.step(kGuard, false, 50 * 16), 0);
  EXPECT_EQ(guard.step(kGuard, false, 50 * 16), 8 * 16);
  for (int k = 0; k < 20; ++k) (void)guard.step(kGuard, false, 0);
  EXPECT_EQ(guard.step(kGuard, false, 0), kGuard.rest);
  EXPECT_EQ(guard.step(kGuard, true, 100 * 16), (29 + 8) * 16);
}

RC_GTEST_PROP(Guard, NeverJumpsOutOfADeadSensorWhateverTheAngles, ()) {
  Guard guard;
  guard.reset(kGuard);
  int16_t before = kGuard.rest;
  bool was_alive = false;
  for (int k = 0; k < 200; ++k) {
    const bool alive = *rc::gen::weightedElement<bool>({{3, true}, {2, false}});
    const auto angle = *rc::gen::inRange<int16_t>(0, 180 * 16);
    const int16_t now = guard.step(kGuard, alive, angle);
    // Two living samples in a row may move freely; everything else is bounded.
    if (!alive || !was_alive) RC_ASSERT(std::abs(now - before) <= kGuard.max_step);
    was_alive = alive;
    before = now;
  }
}

}  // namespace
}  // namespace flexor::sensor
