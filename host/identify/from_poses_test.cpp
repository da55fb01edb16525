#include "host/identify/from_poses.hpp"

#include <cmath>
#include <random>

#include "host/identify/identify_test.hpp"
#include "host/model/compensator.hpp"
#include "host/model/correction.hpp"
#include "host/model/fixed_error.hpp"

namespace flexor::identify {
namespace {

// 20 Hz: three seconds at each of these shares of the way to the fist, half a second in between.
recording::Recording log_of(const std::vector<double>& poses, double noise) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  recording::Recording log;
  log.source = "log.csv";
  log.columns = {{"index_count", {}, "count"}, {"thumb_count", {}, "count"}, {"host_s", {}, ""}};
  double before = poses.front();
  for (const double pose : poses) {
    for (int k = 0; k < 70; ++k) {
      const double at = k < 10 ? before + (pose - before) * k / 10 : pose;
      log.columns[0].value.push_back(std::round(300 + 200 * at + noise * normal(random)));
      log.columns[1].value.push_back(std::round(700 - 150 * at + noise * normal(random)));
      log.columns[2].value.push_back(log.t_s.empty() ? 0 : log.t_s.back());
      log.t_s.push_back(0.05 * static_cast<double>(log.t_s.size()));
    }
    before = pose;
  }
  return log;
}

// Of index and thumb.
void expect_angles(const FromPoses& r, double index, double thumb, double index_deg, double thumb_deg,
                   double within) {
  model::Compensator<model::DoubleArithmetic> compensator(r.model);
  const double readings[] = {index, thumb};
  EXPECT_NEAR(compensator.step(readings)[0].angle_deg, index_deg, within);
  EXPECT_NEAR(compensator.step(readings)[1].angle_deg, thumb_deg, within);
}

TEST(FromPoses, IsTheLineThroughBothPoses) {
  const FromPoses r = model_from_poses(log_of({0, 1, 0, 1}, 1), {});
  ASSERT_EQ(r.model.joints.size(), 2U);
  EXPECT_NEAR(r.model.inputs[0].poses->open, 300, 1);
  EXPECT_NEAR(r.model.inputs[0].poses->fist, 500, 1);
  EXPECT_NEAR(r.model.inputs[1].poses->open, 700, 1);
  EXPECT_NEAR(r.model.inputs[1].poses->fist, 550, 1);
  EXPECT_GE(r.open_holds, 2);
  EXPECT_GE(r.fist_holds, 2);
  ASSERT_EQ(r.warnings.size(), 1U) << "one rises and one falls: nothing says which pose was first";
  EXPECT_TRUE(r.warnings[0].starts_with("thumb_count fall"));
  EXPECT_TRUE(model_from_poses(log_of({0, 1, 0, 1}, 1), {.first = FirstPose::open}).warnings.empty());
  expect_angles(r, 400, 625, 45, 30, 0.6);
}

TEST(FromPoses, VoltsAndTwelveBitsAreHeldAsFinelyAsCounts) {
  for (const auto& [unit, scale] : {std::pair{"V", 5.0 / 1023}, {"mV", 5000.0 / 1023}, {"count", 4.0}}) {
    recording::Recording log = log_of({0, 1, 0, 1}, 1);
    for (std::size_t c = 0; c < 2; ++c) {
      log.columns[c].unit = unit;
      for (double& u : log.columns[c].value) u *= scale;
    }
    const FromPoses r = model_from_poses(log, {});
    expect_angles(r, 400 * scale, 625 * scale, 45, 30, 0.6);
    EXPECT_NEAR(r.model.inputs[0].poses->fist, 500 * scale, scale) << unit;
    const model::Model board = model::folded(r.model).model;
    EXPECT_LT(std::ranges::max(model::worst_fixed_error_deg(board)), model::kFixedError_deg) << unit;
  }
}

TEST(FromPoses, ASensorThatOnlyTremblesOrJumpsToTheEndIsNamedAndTheOthersAreFitted) {
  recording::Recording log = log_of({0, 1, 0, 1}, 1);
  recording::Column dead{"middle_count", {}, "count"};
  for (std::size_t k = 0; k < log.t_s.size(); ++k) dead.value.push_back(360 + static_cast<double>(k % 3) - 1);
  log.columns.push_back(dead);
  log.columns.push_back({"ring_count", std::vector<double>(log.t_s.size(), 1023), "count"});
  for (const char* name : {"pinky_count", "wrist_count"})
    log.columns.push_back({name, log.columns[0].value, "count"});
  for (double& u : log.columns[0].value) u = std::clamp(std::round(5.4 * (u - 305)), 0.0, 1023.0);
  for (double& u : log.columns[5].value) u = u > 450 ? 1023 : u;
  const FromPoses r = model_from_poses(log, {});
  EXPECT_EQ(r.model.joints.size(), 3U);
  EXPECT_EQ(r.model.inputs[0].valid_max, 1023);
  ASSERT_EQ(r.warnings.size(), 4U);
  EXPECT_TRUE(r.warnings[3].starts_with("pinky_count jumps to its converter's end in the fist"));
  EXPECT_EQ(r.warnings[1], "ring_count hardly moves, by 0 from 1023: left out; is it connected?");
  EXPECT_EQ(r.warnings[0], "middle_count hardly moves, by 2 from 359: left out; is it connected?");
}

TEST(FromPoses, MoreDeadSensorsThanLiveOnesAreRefusedByName) {
  recording::Recording log = log_of({0, 1, 0, 1}, 1);
  std::mt19937 random(2);
  std::normal_distribution<double> open_pin(512, 20);
  for (const char* name : {"middle_V", "ring_V", "pinky_V"}) {
    log.columns.push_back({name, log.t_s, "V"});
    for (double& value : log.columns.back().value) value = open_pin(random);
  }
  const std::string reason = io::refusal_of([&] { model_from_poses(log, {}); });
  EXPECT_TRUE(has(reason, "3 of 5 sensors do not tell two poses apart (middle_V, ring_V, pinky_V)"))
      << reason;
}

TEST(FromPoses, ABionicHandsAnglesAreThoseThatAreGiven) {
  const recording::Recording log = log_of({0, 1, 0, 1}, 1);
  const FromPoses r = model_from_poses(log, {20, {{"index", {28, 113}}, {"thumb", {170, 90}}}});
  expect_angles(r, 300, 700, 28, 170, 1);
  expect_angles(r, 500, 550, 113, 90, 1);
  EXPECT_THROW(model_from_poses(log, {20, {{"ring", {0, 90}}}}), io::InputError);
  EXPECT_THROW(model_from_poses(log, {20, {{"index", {30, 30}}}}), io::InputError);
}

TEST(FromPoses, EitherOrderIsFound) {
  recording::Recording log = log_of({1, 0, 1, 0}, 1);
  for (double& value : log.columns[1].value) value = 1000 - value;  // both fall to the second pose
  const FromPoses found = model_from_poses(log, {});
  EXPECT_NEAR(found.model.inputs[0].poses->open, 300, 1);
  EXPECT_NEAR(found.model.inputs[1].poses->fist, 450, 1);
  EXPECT_EQ(found.warnings.size(), 1U);
  EXPECT_NEAR(model_from_poses(log, {.first = FirstPose::open}).model.inputs[0].poses->open, 500, 1);
  EXPECT_TRUE(model_from_poses(log, {.first = FirstPose::fist}).warnings.empty());
}

TEST(FromPoses, JointsHaveTheNamesThatAreGiven) {
  recording::Recording log = log_of({0, 1, 0, 1}, 1);
  log.columns[0].name = "column2";
  const FromPoses r = model_from_poses(log, {.angles = {{"index", {0, 70}}}, .joints = {"index", "thumb"}});
  EXPECT_EQ(r.model.joints[0].name, "index");
  EXPECT_EQ(r.model.inputs[0].column, "column2");
  EXPECT_EQ(r.model.joints[0].ends->fist_deg, 70);
  EXPECT_THROW(model_from_poses(log, {.joints = {"index"}}), io::InputError);
}

TEST(FromPoses, RefusesAMotionThatOnlyRestsNowAndThen) {
  EXPECT_THROW(model_from_poses(log_of({0, 1, 0.2, 0.6, 0.05, 0.95, 0.25, 0.62}, 1), {}), io::JobError);
}

TEST(FromPoses, RefusesWhatHoldsNoTwoPoses) {
  for (const double noise : {1, 5}) {
    const std::string reason = io::refusal_of([&] { model_from_poses(log_of({0, 0, 0}, noise), {}); });
    EXPECT_NE(reason.find("one pose tells nothing"), std::string::npos) << reason;
  }
  recording::Recording restless = log_of({0, 1}, 0);
  for (std::size_t k = 0; k < restless.t_s.size(); ++k)
    restless.columns[0].value[k] = restless.columns[1].value[k] = k % 10 < 5 ? 300 : 500;
  EXPECT_THROW(model_from_poses(restless, {}), io::JobError);
}

TEST(FromPoses, LeavesASensorOutThatDoesNotFollow) {
  recording::Recording log = log_of({0, 1, 0, 1}, 1);
  for (std::size_t k = 0; k < log.t_s.size(); ++k) log.columns[1].value[k] = k % 70 < 10 ? 700.0 : 650.0;
  const FromPoses r = model_from_poses(log, {});
  ASSERT_EQ(r.model.joints.size(), 1U);
  EXPECT_EQ(r.model.joints[0].name, "index");
  EXPECT_EQ(r.warnings.size(), 1U);
}

}  // namespace
}  // namespace flexor::identify
