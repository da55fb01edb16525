#include "host/twin/motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "host/io/io.hpp"

namespace flexor::twin {
namespace {

Motion gesture(const std::string& name) {
  const std::string path = std::string(FLEXOR_SOURCE_DIR) + "/models/gestures/" + name + ".json";
  return Motion::from_json(io::read_file(path), path);
}

std::string message(const std::string& text) {
  try {
    (void)Motion::from_json(text, "g.json");
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "accepted";
}

constexpr const char* kStart =
    R"({"schema":"flexor-gesture","schema_version":1,"name":"x","duration_s":5,"corner_s":0.1,"speed_deg_s":80,)"
    R"("start":40,"moves":[)";

TEST(Motion, GestureOneDoesWhatTheArticleSays) {
  const Motion grab = gesture("1");
  EXPECT_DOUBLE_EQ(grab.angle(2, 0, {}), 112);
  EXPECT_NEAR(grab.angle(2, 4.7, {}), 29, 1e-9);
  EXPECT_NEAR(grab.angle(2, 5.4, {}), 29, 1e-9);
  EXPECT_NEAR(grab.angle(2, 7.0, {}), 112, 1e-9);
  EXPECT_NEAR(grab.travel_deg(), 2 * (80 + 4 * 83), 1e-9);
}

TEST(Motion, FingersKeepTheStatedSpeedBetweenRoundedCorners) {
  const Motion grab = gesture("1");
  constexpr double h = 1e-4;
  double fastest = 0;
  double jerkiest = 0;
  for (double t = 3; t < 7; t += 0.001) {
    fastest = std::max(fastest, std::abs(grab.angle(1, t + h, {}) - grab.angle(1, t, {})) / h);
    const double bend =
        grab.angle(1, t + 0.002, {}) - 2 * grab.angle(1, t + 0.001, {}) + grab.angle(1, t, {});
    jerkiest = std::max(jerkiest, std::abs(bend) / 1e-6);
  }
  EXPECT_NEAR(fastest, 83, 0.1);
  EXPECT_NEAR(jerkiest, 830, 10);  // 83 deg/s reached within 0.1 s
}

TEST(Motion, EveryGestureStaysInsideTheHandsLimits) {
  for (const char* name : {"1", "2", "3", "4", "5", "6", "calibration"}) {
    const Motion m = gesture(name);
    for (int i = 0; i < kFingers; ++i) {
      for (double t = -1; t < m.duration_s() + 1; t += 0.01) {
        const double angle = m.angle(i, t, {});
        EXPECT_GE(angle, i == 0 ? 90 : 28) << name;
        EXPECT_LE(angle, i == 0 ? 170 : 113) << name;
      }
    }
  }
}

TEST(Motion, AQuickPersonStartsWithTheOthersAndEndsSooner) {
  const Motion grab = gesture("1");
  Variation quick;
  quick.speed = 1.25;
  EXPECT_DOUBLE_EQ(grab.angle(1, 3.5, quick), 112);
  EXPECT_LT(grab.angle(1, 4, quick), grab.angle(1, 4, {}));
  Variation late;
  late.delay_s = 0.2;
  EXPECT_DOUBLE_EQ(grab.angle(1, 4.2, late), grab.angle(1, 4, {}));
}

TEST(Motion, RefusesWhatMakesNoSense) {
  const std::string start = kStart;
  EXPECT_NE(message("{}").find("not a gesture"), std::string::npos);
  EXPECT_NE(message(start + R"({"start_s":1,"fingers":["toe"],"to":90}]})").find("unknown finger"),
            std::string::npos);
  EXPECT_NE(message(start + R"({"start_s":1,"fingers":["index"],"to":"fist"}]})").find("neither an angle"),
            std::string::npos);
  EXPECT_NE(
      message(start +
              R"({"start_s":1,"fingers":["index"],"to":90},{"start_s":1.2,"fingers":["index"],"to":40}]})")
          .find("start later"),
      std::string::npos);
  EXPECT_NE(message(start + R"({"start_s":1,"fingers":["index"],"to":90,"sped":3}]})").find("unknown key"),
            std::string::npos);
}

TEST(Motion, RecordedMotionRunsThroughItsSamplesAndHoldsItsEnds) {
  std::array<std::vector<double>, kFingers> angle;
  for (auto& finger : angle) finger = {30, 50, 40};
  const Motion m = Motion::from_samples("r", {0, 1, 3}, angle);
  EXPECT_DOUBLE_EQ(m.angle(0, -5, {}), 30);
  EXPECT_DOUBLE_EQ(m.angle(1, 0.5, {}), 40);
  EXPECT_DOUBLE_EQ(m.angle(2, 2, {}), 45);
  EXPECT_DOUBLE_EQ(m.angle(3, 9, {}), 40);
}

}  // namespace
}  // namespace flexor::twin
