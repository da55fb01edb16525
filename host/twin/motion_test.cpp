#include "host/twin/motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"

namespace flexor::twin {
namespace {

Motion gesture(const std::string& name) {
  const std::string path = std::string(FLEXOR_SOURCE_DIR) + "/models/gestures/" + name + ".json";
  return Motion::from_json(io::read_file(path), path);
}

constexpr const char* kStart =
    R"({"schema":"flexor-gesture","schema_version":1,"name":"x","duration_s":5,"corner_s":0.1,"speed_deg_s":80,)"
    R"("start":40,"moves":[)";

TEST(Motion, GestureOneDoesWhatTheArticleDescribes) {
  const Motion grab = gesture("1");
  EXPECT_DOUBLE_EQ(grab.angle(2, 0, {}), 112);
  EXPECT_NEAR(grab.angle(2, 4.7, {}), 29, 1e-9);
  EXPECT_NEAR(grab.angle(2, 5.4, {}), 29, 1e-9);
  EXPECT_NEAR(grab.angle(2, 7.0, {}), 112, 1e-9);
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

TEST(Motion, ATurnTooSmallToTakeTimeIsNone) {
  std::string text = kStart;
  text.replace(text.find("\"start\":40"), 10, "\"start\":0");
  const Motion m = Motion::from_json(text + R"({"start_s":1,"fingers":["ring"],"to":5e-324}]})", "g.json");
  for (const double t : {0.5, 1.05, 3.0}) EXPECT_EQ(m.angle(3, t, {}), 0) << t;
}

TEST(Motion, EveryGestureStaysInsideTheHandsLimits) {
  for (const char* name : {"1", "2", "3", "4", "5", "6", "calibration", "protocol"}) {
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

TEST(Motion, ALatePersonIsLate) {
  Variation late;
  late.delay_s = 0.2;
  EXPECT_DOUBLE_EQ(gesture("1").angle(1, 4.2, late), gesture("1").angle(1, 4, {}));
}

// A person of another speed starts the first move when the plan has it: at 0 s as well as later.
TEST(Motion, AMoveAtZeroSecondsStartsAtZeroForAQuickPersonToo) {
  const std::string start = kStart;
  const Motion m = Motion::from_json(
      start + R"({"start_s":0,"fingers":["index"],"to":90},{"start_s":2,"fingers":["middle"],"to":90}]})",
      "g.json");
  Variation quick;
  quick.speed = 1.25;
  EXPECT_DOUBLE_EQ(m.angle(1, 0, quick), 40);
  EXPECT_GT(m.angle(1, 0.1, quick), 40);
  EXPECT_DOUBLE_EQ(m.angle(2, 1.6, quick), 40);
  EXPECT_GT(m.angle(2, 1.7, quick), 40);
}

TEST(Motion, RefusesWhatMakesNoSenseInOneLineThatNamesIt) {
  const auto with = [](const char* key, const std::string& value) {
    nlohmann::json json =
        nlohmann::json::parse(std::string(kStart) + R"({"start_s":1,"fingers":["index"],"to":90}]})");
    json[key] = nlohmann::json::parse(value);
    return json.dump();
  };
  const auto moved = [&](const std::string& moves) { return with("moves", "[" + moves + "]"); };
  const std::pair<std::string, const char*> cases[] = {
      {"{}", "flexor-gesture"},
      {with("duration_s", "1e308"), "duration_s"},
      {with("corner_s", "1e-300"), "corner_s"},
      {with("speed_deg_s", "1e-300"), "speed_deg_s"},
      {with("number", "2.5"), "number"},
      {with("start", "-200"), "-200 degrees"},
      {with("start", "null"), "neither an angle"},
      {with("moves", "{}"), "must be a list"},
      {moved(R"({"start_s":1e308,"fingers":["index"],"to":90})"), "\"start_s\" is 1e+308"},
      {moved(R"({"start_s":1,"fingers":["index"],"to":1e308})"), "1e+308 degrees"},
      {moved(R"({"start_s":1,"fingers":["index"],"to":"fist"})"), "neither an angle"},
      {moved(R"({"start_s":1,"fingers":["index"],"to":90,"speed_deg_s":1e-300})"), "speed_deg_s"},
      {moved(R"({"start_s":1,"fingers":["toe"],"to":90})"), "moves: unknown finger \"toe\""},
      {moved(R"({"start_s":1,"fingers":["index"],"to":90,"sped":3})"), "unknown key"},
      {moved(R"({"start_s":1,"fingers":["index"],"to":90},{"start_s":1.2,"fingers":["index"],"to":40})"),
       "start later"},
  };
  for (const auto& [text, reason] : cases) {
    io::expect_refused([&] { (void)Motion::from_json(text, "g.json"); }, reason);
    EXPECT_TRUE(io::refusal_of([&] { (void)Motion::from_json(text, "g.json"); }).starts_with("g.json: "));
  }
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
