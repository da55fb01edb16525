#include "runtime/hand/finger.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdlib>

namespace flexor::hand {
namespace {

constexpr int32_t per_tick(double deg_s) { return static_cast<int32_t>(deg_s / 1000 * (1 << 20)); }

FingerSettings settings() {
  FingerSettings c{};
  c.loop = {28 * 16, 113 * 16, per_tick(400), 2000, 1700, kFullDuty << 6, kFullDuty, 0};
  c.potentiometer = {256250, 0, 5, 1018};  // 250 degrees over 1023 counts
  c.careful_step = per_tick(150);
  return c;
}

constexpr int16_t kRest = 29 * 16;

// A motor whose speed is its duty: nothing is known of it, so that nothing but its potentiometer is watched.
struct Bench {
  FingerSettings c = settings();
  Finger finger;
  LinkWatch link;
  double angle_deg = 60;
  double fastest_deg_s = 0;
  int16_t duty = 0;

  uint16_t counts() const { return static_cast<uint16_t>(std::lround(angle_deg * 1023 / 250)); }
  void tick(int16_t command, bool frame) {
    if (frame) link.frame();
    duty = finger.tick(c, link.tick(), command, kRest, counts());
    const double speed = 600.0 * duty / kFullDuty;
    fastest_deg_s = std::max(fastest_deg_s, std::abs(speed));
    angle_deg += speed / 1000;
  }
  void run(int ms, int16_t command, bool frames) {
    for (int k = 0; k < ms; ++k) tick(command, frames && k % 50 == 0);
  }
};

TEST(Finger, StaysWhereItIsUntilAFrameComes) {
  Bench bench;
  bench.run(2000, 110 * 16, false);
  EXPECT_NEAR(bench.angle_deg, 60, 0.3);
}

TEST(Finger, StartsCarefullyThenFollowsAtFullSpeed) {
  Bench bench;
  bench.run(600, 110 * 16, true);
  EXPECT_NEAR(bench.angle_deg, 110, 1.5);  // the integral of the way there
  EXPECT_LT(bench.fastest_deg_s, 200);
  bench.run(300, 40 * 16, true);
  EXPECT_GT(bench.fastest_deg_s, 330);
  EXPECT_LT(bench.fastest_deg_s, 480);
}

TEST(Finger, HoldsAQuarterSecondWithoutFramesThenRestsCarefullyAndResumesWithoutAJump) {
  Bench bench;
  bench.run(1000, 100 * 16, true);
  bench.run(200, 100 * 16, false);  // the last frame came 50 ms before
  EXPECT_NEAR(bench.angle_deg, 100, 0.3);
  bench.fastest_deg_s = 0;
  bench.run(1000, 100 * 16, false);
  EXPECT_NEAR(bench.angle_deg, 29, 1.5);
  EXPECT_EQ(bench.finger.fault(), Fault::none);
  bench.run(800, 100 * 16, true);
  EXPECT_NEAR(bench.angle_deg, 100, 1.5);
  EXPECT_LT(bench.fastest_deg_s, 200);
}

TEST(Finger, AnUnpluggedPotentiometerStopsTheMotor) {
  Bench bench;
  bench.run(500, 100 * 16, true);
  for (const uint16_t counts : {uint16_t{0}, uint16_t{1023}}) {
    EXPECT_EQ(bench.finger.tick(bench.c, Link::following, 50 * 16, kRest, counts), 0);
    EXPECT_EQ(bench.finger.fault(), Fault::blind);
  }
  bench.fastest_deg_s = 0;
  bench.run(500, 50 * 16, true);
  EXPECT_EQ(bench.finger.fault(), Fault::none);
  EXPECT_LT(bench.fastest_deg_s, 200);
}

RC_GTEST_PROP(Finger, TheSetPointNeverLeavesPsiNorExceedsItsSpeed, ()) {
  Bench bench;
  bench.tick(0, false);
  const int16_t furthest = static_cast<int16_t>(std::ceil(400.0 / 1000 * 16)) + 1;
  for (int k = 0; k < 300; ++k) {
    const int16_t before = bench.finger.setpoint();
    const auto command = *rc::gen::arbitrary<int16_t>();
    bench.tick(command, *rc::gen::weightedElement<bool>({{1, true}, {9, false}}));
    RC_ASSERT(bench.finger.setpoint() >= bench.c.loop.lower);
    RC_ASSERT(bench.finger.setpoint() <= bench.c.loop.upper);
    RC_ASSERT(std::abs(bench.finger.setpoint() - before) <= furthest);
  }
}

TEST(PositionLoop, FeedForwardTakesAwayTheLagOfARamp) {
  const auto lag_deg = [](int16_t feed_forward) {
    LoopSettings c = settings().loop;
    c.integral = 0;
    c.feed_forward = feed_forward;
    LoopState state{};
    double angle = 40;
    double last = 0;
    start(c, state, 40 * 16);
    for (int k = 0; k < 500; ++k) {
      const double command = 40 + 0.1 * k;  // 100 degrees a second
      const int16_t duty = step(c, state, static_cast<int16_t>(std::lround(16 * command)),
                                static_cast<int16_t>(std::lround(16 * angle)));
      angle += 0.6 * duty / kFullDuty;
      last = command - angle;
    }
    return last;
  };
  EXPECT_GT(lag_deg(0), 2);
  EXPECT_NEAR(lag_deg(static_cast<int16_t>(32767)), lag_deg(0) * (1 - 0.6),
              0.5);  // 0.6 of the 54612 it would need
}

}  // namespace
}  // namespace flexor::hand
