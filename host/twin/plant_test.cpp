#include "host/twin/plant.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <memory>

#include "host/twin/plant_step.hpp"

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

// Half a second of full duty up against a stop at 113 degrees, and none after it.
PlantState<5> pushed_against_a_stop(double stiffness_mNm_deg, double damping_mNms_deg, float* furthest_deg) {
  Parameters p;
  p.stop_stiffness_mNm_deg = stiffness_mNm_deg;
  p.stop_damping_mNms_deg = damping_mNms_deg;
  p.backlash_deg = 0;
  const PlantConstants c(p);
  const auto x = at_rest(60);
  for (int ms = 0; ms < 1500; ++ms) {
    for (int i = 0; i < 5; ++i) detail::move_hand(c, *x, i, ms < 500 ? hand::kFullDuty : std::int16_t{0});
    *furthest_deg = std::max(*furthest_deg, x->joint[0]);
  }
  return *x;
}

TEST(Plant, AStopThatGivesTakesWhatTheMotorHasAndCountsImpacts) {
  float furthest_deg = 0;
  const PlantState<5> soft = pushed_against_a_stop(100, 0.05, &furthest_deg);
  // The current's limit: 1.2 A times 148.5 mNm/A is 1.8 degrees of it, and what the arrival adds.
  EXPECT_GT(furthest_deg, 113 + 1.5F);
  EXPECT_LT(furthest_deg, 113 + 6.0F);
  EXPECT_GE(soft.impacts[0], 1);
  EXPECT_LE(soft.impacts[0], 3) << "it bounces, but not for ever";
  EXPECT_GT(soft.impact_deg_s[0], 700);
  EXPECT_GT(soft.pressed_ms[0], 350);
  EXPECT_LT(soft.joint[0] - 113, 12.1F / 100) << "friction holds what is left";
  furthest_deg = 0;
  const PlantState<5> rigid = pushed_against_a_stop(0, 0.05, &furthest_deg);
  EXPECT_EQ(furthest_deg, 113.0F);
  EXPECT_EQ(rigid.impacts[0], 1);
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
