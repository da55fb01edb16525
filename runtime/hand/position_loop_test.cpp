#include "runtime/hand/position_loop.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace flexor::hand {
namespace {

constexpr LoopSettings kSettings = {28 * 16,   113 * 16, 300 * (1 << 20) / 1000, 2000, 1700, kFullDuty << 7,
                                    kFullDuty, 0};

// A motor without inertia: its speed is its duty. Enough to see what the loop does with a command.
double settle(const LoopSettings& c, double from_deg, int16_t command, int ticks, double load_deg_s = 0,
              double* fastest_deg_s = nullptr) {
  constexpr double kFullSpeed = 600;  // deg/s
  LoopState state{};
  double angle = from_deg;
  start(c, state, static_cast<int16_t>(std::lround(angle * 16)));
  for (int k = 0; k < ticks; ++k) {
    const int16_t duty = step(c, state, command, static_cast<int16_t>(std::lround(angle * 16)));
    const double speed = kFullSpeed * duty / kFullDuty + load_deg_s;
    if (fastest_deg_s != nullptr) *fastest_deg_s = std::max(*fastest_deg_s, std::abs(speed));
    angle += speed / 1000;
  }
  return angle;
}

TEST(PositionLoop, ReachesItsCommandUnderASteadyLoad) {
  EXPECT_NEAR(settle(kSettings, 30, 80 * 16, 4000), 80, 0.1);
  EXPECT_NEAR(settle(kSettings, 30, 80 * 16, 4000, -40), 80, 0.1);
}

RC_GTEST_PROP(PositionLoop, NeverAsksForMoreThanItsLimits, ()) {
  LoopSettings c = kSettings;
  c.integral_limit = *rc::gen::inRange<int32_t>(0, kMaxIntegral);
  c.duty_limit = *rc::gen::inRange<int16_t>(0, kFullDuty);
  c.proportional = *rc::gen::inRange<int16_t>(0, 32767);
  c.integral = *rc::gen::inRange<int16_t>(0, 32767);
  LoopState state{};
  start(c, state, 40 * 16);
  for (int k = 0; k < 50; ++k) {
    const auto command = *rc::gen::arbitrary<int16_t>();
    const auto measured = *rc::gen::arbitrary<int16_t>();
    const int32_t before = state.setpoint;
    const int16_t duty = step(c, state, command, measured);
    RC_ASSERT(std::abs(duty) <= c.duty_limit);
    RC_ASSERT(std::abs(state.integral) <= c.integral_limit);
    RC_ASSERT(state.setpoint >= c.lower << 16);
    RC_ASSERT(state.setpoint <= c.upper << 16);
    RC_ASSERT(std::abs(state.setpoint - before) <= c.max_step);
  }
}

TEST(PositionLoop, MovesNoFasterThanItsBoundWhereTheLoopIsTight) {
  double fastest = 0;
  settle(kSettings, 30, 110 * 16, 1000, 0, &fastest);
  EXPECT_GT(fastest, 250);
  EXPECT_LT(fastest, 330);  // 300 deg/s and the integral's overshoot
}

TEST(PositionLoop, AFingerThatIsHeldDoesNotWindUp) {
  LoopState state{};
  start(kSettings, state, 30 * 16);
  for (int k = 0; k < 5000; ++k) (void)step(kSettings, state, 110 * 16, 30 * 16);
  // Let go and commanded back, it must not first fly to the far end.
  int16_t duty = 0;
  for (int k = 0; k < 300; ++k) duty = step(kSettings, state, 30 * 16, 30 * 16);
  EXPECT_LE(duty, kFullDuty / 2);  // the integral's limit
}

}  // namespace
}  // namespace flexor::hand
