#include "apps/live/fingers.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/model/sensor_model_test.hpp"

namespace flexor::live {
namespace {

constexpr double kFingersRate_hz = 50;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// Whole bends of eight seconds each, of a sensor that drifts by so much and has shifted by so many counts.
double wear(Fingers& fingers, double from_s, double seconds, double drift_per_s, double shift = 0) {
  const double to_s = from_s + seconds;
  for (double t_s = from_s; t_s < to_s; t_s += 1 / kFingersRate_hz) {
    const double phase = std::fmod(t_s, 8);
    const double closed = phase < 1 ? phase : phase < 4 ? 1 : phase < 5 ? 5 - phase : 0;
    fingers.add({t_s, t_s, {300 + shift + 400 * closed + drift_per_s * (t_s - from_s)}, {}});
  }
  return to_s;
}

bool holds(const std::string& text, const char* what) { return text.find(what) != std::string::npos; }

TEST(Fingers, StateHowASensorIsTrackedAndWhenItDriftsMoreQuickly) {
  Fingers fingers({"index_count"});
  fingers.wear(model::sensor_model(model::Poses{300, 700}), true);
  double now_s = wear(fingers, 0, 160, 0);
  FingerView view = fingers.view(now_s).front();
  EXPECT_TRUE(holds(view.tracked, "tracked: shifted by")) << view.tracked;
  EXPECT_EQ(view.remark, "");
  now_s = wear(fingers, now_s, 40, 7);
  view = fingers.view(now_s).front();
  EXPECT_TRUE(holds(view.tracked, "drifted more quickly")) << view.tracked;
  EXPECT_FALSE(view.remark.empty());
  EXPECT_EQ(view.quality, "fair");
}

TEST(Fingers, ThatArePoorAreNoBetterForAReadingBeyondThose) {
  model::Model m = model::sensor_model({});
  m.joints[0].accuracy = model::Accuracy{{28, 113}, {20, 20}};
  m.inputs[0].readings = model::Spread{{0, 1}, {300, 700}};
  Fingers fingers({"index_count"});
  fingers.wear(m, false);
  for (int k = 0; k < 3; ++k) fingers.add({0, 0, {800}, {}});
  EXPECT_TRUE(holds(fingers.view(0).front().remark, "beyond"));
  EXPECT_EQ(fingers.view(0).front().quality, "poor");
}

TEST(Fingers, ASlipIsSeenThoughNoChangeIsFollowed) {
  Fingers fingers({"index_count"});
  fingers.wear(model::sensor_model(model::Poses{300, 700}), false);
  const double now_s = wear(fingers, 0, 80, 0);
  EXPECT_FALSE(fingers.has_slipped());
  wear(fingers, now_s, 80, 0, 40);
  EXPECT_TRUE(fingers.has_slipped());
  EXPECT_EQ(fingers.view(now_s + 80).front().tracked, "");
}

TEST(Fingers, OfAModelThatCannotBeTrackedAreNot) {
  EXPECT_TRUE(can_be_tracked(model::sensor_model(model::Poses{300, 700})));
  EXPECT_FALSE(can_be_tracked(model::sensor_model({})));
  Fingers fingers({"index_count"});
  fingers.wear(model::sensor_model({}), true);
  EXPECT_EQ(fingers.view(wear(fingers, 0, 1, 0)).front().tracked, "");
}

TEST(Fingers, ASensorThatHasNotMovedAndOneWhoseWireIsLooseAreReported) {
  Fingers fingers({"index_count", "middle_count", "ring_count"});
  for (int k = 0; k < 20; ++k) fingers.add({0.01 * k, 0.01 * k, {500.0 + 10 * k, 500.0 + k % 2, 1023}, {}});
  const std::vector<FingerView> view = fingers.view(0.2);
  EXPECT_EQ(view[0].quality, "none");
  EXPECT_EQ(view[0].remark, "");
  EXPECT_EQ(view[1].quality, "none");
  EXPECT_EQ(view[1].remark, "has not moved yet");
  EXPECT_EQ(view[2].quality, "poor");
  EXPECT_TRUE(holds(view[2].remark, "wire loose")) << view[2].remark;
}

model::Model two_sensors() {
  model::Model two = model::sensor_model(model::Poses{300, 700});
  model::Channel c;
  c.name = "middle";
  c.input_column = "middle_count";
  c.valid_min = 150;
  c.valid_max = 850;
  c.saturation = {28, 113};
  model::add(two, c);
  return two;
}

TEST(Fingers, ASensorThatStandsWhileAnotherMovesIsNotGood) {
  model::Model two = two_sensors();
  two.inputs[0].readings = two.inputs[1].readings = model::Spread{{0, 1}, {300, 700}};
  Fingers fingers({"index_count", "middle_count"});
  fingers.wear(two, false);
  for (int k = 0; k < 20; ++k) fingers.add({0.01 * k, 0.01 * k, {400.0 + k, 500}, {}});
  EXPECT_EQ(fingers.view(0.2)[1].quality, "good") << "nothing was asked of it yet";
  for (int k = 0; k < 20; ++k) fingers.add({0.2 + 0.01 * k, 0.2 + 0.01 * k, {400.0 + 15 * k, 500}, {}});
  EXPECT_EQ(fingers.view(0.4)[0].quality, "good");
  EXPECT_EQ(fingers.view(0.4)[1].quality, "fair");
  EXPECT_EQ(fingers.view(0.4)[1].remark, "has not moved yet");
}

TEST(Fingers, StateWhichSensorIsNotTrackedBesideOthers) {
  const model::Model two = two_sensors();
  Fingers fingers({"index_count", "middle_count"});
  fingers.wear(two, true);
  fingers.add({0, 0, {300, 300}, {}});
  const std::vector<FingerView> view = fingers.view(0);
  EXPECT_TRUE(holds(view[0].tracked, "tracked: shifted")) << view[0].tracked;
  EXPECT_TRUE(holds(view[1].tracked, "not tracked")) << view[1].tracked;
  EXPECT_EQ(view[0].open_deg, model::ends(two, two.joints[0]).open_deg);
  EXPECT_EQ(view[1].fist_deg, 113);
}

// A dead sensor reads nan: least and most are those of its readings, and the angle is held.
TEST(Fingers, WithoutAReadingKeepTheirRangeAndReportIt) {
  Fingers fingers({"index_count"});
  for (const double reading : {300.0, 400.0, kMissing, 350.0, kMissing, 500.0, 500.0, 500.0, kMissing})
    fingers.add({0, 0, {reading}, {}});
  const FingerView bare = fingers.view(0).front();
  EXPECT_EQ(bare.least, 350);
  EXPECT_EQ(bare.most, 500);
  EXPECT_TRUE(std::isnan(bare.raw));
  EXPECT_TRUE(std::isnan(fingers.raw().front()));
  EXPECT_EQ(bare.remark, "no reading");
  EXPECT_TRUE(std::isnan(bare.open_deg) && std::isnan(bare.fist_deg)) << "no model has it";
  EXPECT_EQ(bare.quality, "poor");

  fingers.wear(model::sensor_model({}), false);
  double now_s = wear(fingers, 1, 4, 0);
  const double held_deg = fingers.view(now_s).front().angle_deg;
  EXPECT_TRUE(std::isfinite(held_deg));
  for (int k = 0; k < 20; ++k, now_s += 1 / kFingersRate_hz) fingers.add({now_s, now_s, {kMissing}, {}});
  const FingerView dead = fingers.view(now_s).front();
  EXPECT_NEAR(dead.angle_deg, held_deg, 1);
  EXPECT_EQ(dead.remark, "no good reading: the last good angle is held");
  wear(fingers, now_s, 1, 0);
  EXPECT_EQ(fingers.view(now_s + 1).front().remark, "") << "it reads again";
}

}  // namespace
}  // namespace flexor::live
