#include "host/twin/plant.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <memory>

namespace flexor::twin {
namespace {

std::unique_ptr<PlantState<5>> at_rest(float angle) {
  auto x = std::make_unique<PlantState<5>>();
  for (int i = 0; i < 5; ++i) {
    x->reference[i] = x->slipped[i] = x->visco[i] = x->creep[i] = angle;
    x->motor[i] = x->joint[i] = angle;
    x->lower[i] = 28;
    x->upper[i] = 113;
    x->command[i] = static_cast<std::int32_t>(std::lround(16 * angle));
    x->setpoint[i] = x->command[i] << 16;
    x->noise[i] = 1 + static_cast<std::uint32_t>(i);
  }
  return x;
}

RC_GTEST_PROP(Plant, FrictionNeverCreatesEnergy, ()) {
  // No supply, no disturbance: whatever the speed, it can only fall, and never turn round.
  Parameters p;
  p.loop_proportional_per_deg = 0;
  p.loop_integral_per_deg_s = 0;
  p.coulomb_mNm = *rc::gen::inRange(0, 1000) / 10.0;
  p.viscous_mNms_rad = *rc::gen::inRange(0, 1000) / 10.0;
  const PlantConstants c(p);
  const auto x = at_rest(70);
  for (float& speed : x->speed) speed = static_cast<float>(*rc::gen::inRange(-2000, 2000));
  for (int k = 0; k < 300; ++k) {
    const PlantState<5> before = *x;
    advance(c, *x);
    for (int i = 0; i < 5; ++i) {
      RC_ASSERT(std::abs(x->speed[i]) <= std::abs(before.speed[i]));
      RC_ASSERT(x->speed[i] * before.speed[i] >= 0);
    }
  }
}

RC_GTEST_PROP(Plant, NoCommandMovesAJointOutOfItsLimits, ()) {
  Parameters p;
  p.loop_proportional_per_deg = *rc::gen::inRange(0, 99) / 100.0;
  p.loop_integral_per_deg_s = *rc::gen::inRange(0, 39) / 10.0;
  p.disturbance_mNm = 500;
  const PlantConstants c(p);
  const auto x = at_rest(70);
  for (int k = 0; k < 50; ++k) {
    for (int i = 0; i < 5; ++i) {
      x->command[i] = *rc::gen::arbitrary<std::int16_t>();
      x->disturbance[i] = static_cast<float>(*rc::gen::inRange(-500, 501));
    }
    for (int ms = 0; ms < 20; ++ms) {
      advance(c, *x);
      for (int i = 0; i < 5; ++i) {
        RC_ASSERT(x->joint[i] >= 28.0F);
        RC_ASSERT(x->joint[i] <= 113.0F);
        RC_ASSERT(std::isfinite(x->speed[i]));
      }
    }
  }
}

// A motor that runs freely into its stop arrives with its no-load speed, once, and then presses.
TEST(Plant, AStopIsHitWithTheMotorsSpeedAndPressedUntilTheDutyIsGone) {
  Parameters p;
  p.coulomb_mNm = 0;
  p.viscous_mNms_rad = 0;
  p.loop_proportional_per_deg = 0.9;
  p.loop_integral_per_deg_s = 0;
  p.loop_speed_deg_s = 100000;
  const PlantConstants c(p);
  const auto x = at_rest(30);
  for (float& upper : x->upper) upper = 150;
  for (std::int32_t& command : x->command) command = 180 * 16;
  int arrived_ms = 0;
  while (x->motor[0] < 150.2F && arrived_ms < 1000) {
    EXPECT_EQ(x->impact_deg_s[0], 0);
    advance(c, *x);
    ++arrived_ms;
  }
  const double no_load_deg_s = 6 / (0.0018 * 150) * 57.2958;
  EXPECT_NEAR(x->impact_deg_s[0], no_load_deg_s, 5);
  const std::int32_t at_first = x->pressed_ms[0];
  for (int ms = 0; ms < 100; ++ms) advance(c, *x);
  EXPECT_EQ(x->pressed_ms[0], at_first + 100);
  EXPECT_NEAR(x->impact_deg_s[0], no_load_deg_s, 5);  // pressing on is no second arrival
  for (std::int32_t& command : x->command) command = 100 * 16;
  for (int ms = 0; ms < 1000; ++ms) advance(c, *x);
  EXPECT_LE(x->pressed_ms[0], at_first + 102);
}

TEST(Plant, AFreeMotorReachesItsNoLoadSpeed) {
  Parameters p;
  p.coulomb_mNm = 0;
  p.viscous_mNms_rad = 0;
  p.loop_proportional_per_deg = 0.9;
  p.loop_speed_deg_s = 100000;
  const PlantConstants c(p);
  const auto x = at_rest(30);
  for (float& upper : x->upper) upper = 1e6F;
  for (std::int32_t& command : x->command) command = 180 * 16;
  for (int ms = 0; ms < 100; ++ms) advance(c, *x);
  // V / K_e, K_e = 1.8 mNm/A times 150: 22.2 rad/s
  EXPECT_NEAR(x->speed[0], 6 / (0.0018 * 150) * 57.2958, 5);
}

TEST(Plant, ClothSlipsByItsPlayAndNoMore) {
  Parameters p;
  p.slip_deg = 2;
  p.visco_share = 0;
  p.creep_share = 0;
  const PlantConstants c(p);
  const auto x = at_rest(50);
  const auto move = [&](float slope, int ms) {
    for (float& s : x->reference_slope) s = slope;
    for (int k = 0; k < ms; ++k) advance(c, *x);
  };
  move(0.1F, 100);
  EXPECT_NEAR(bend(c, *x, 0), 58, 1e-3);
  move(-0.1F, 30);
  EXPECT_NEAR(bend(c, *x, 0), 58, 1e-3);
  move(-0.1F, 70);
  EXPECT_NEAR(bend(c, *x, 0), 52, 1e-3);
}

TEST(Plant, CreepSettlesAtTheFingersAngle) {
  Parameters p;
  p.slip_deg = 0;
  p.visco_share = 0;
  p.creep_share = 0.2;
  p.creep_s = 0.5;
  const PlantConstants c(p);
  const auto x = at_rest(50);
  for (float& reference : x->reference) reference = 60;
  advance(c, *x);
  EXPECT_NEAR(bend(c, *x, 0), 58, 0.05);
  for (int ms = 0; ms < 500; ++ms) advance(c, *x);
  EXPECT_NEAR(bend(c, *x, 0), 60 - 2 * std::exp(-1.0), 0.02);
  for (int ms = 0; ms < 4000; ++ms) advance(c, *x);
  EXPECT_NEAR(bend(c, *x, 0), 60, 0.01);
}

}  // namespace
}  // namespace flexor::twin
