// recalibrate on files: what other tools depend on, whatever the files hold.
#include "host/identify/recalibrate_files.hpp"

#include <fmt/format.h>

#include "host/identify/identify_test.hpp"

namespace flexor::identify {
namespace {

constexpr double kCameraAhead_s = 7.3;
constexpr double kMovedBy = 60;  // counts, each sensor

// A hand that never bends twice alike: 0 straight, 1 a fist, each finger a third of a second after the one before.
double bend(double t_s, std::size_t finger) {
  const double t = t_s - 0.35 * static_cast<double>(finger);
  const double slow = 0.5 - 0.5 * std::cos(1.7 * t + 0.8 * std::sin(0.31 * t));
  return std::clamp(slow * (1.05 + 0.1 * std::sin(0.9 * t)), 0.0, 1.0);
}

double reading(double share) { return kTestStraight + share * (kTestFist - kTestStraight) - kMovedBy; }

using Cell = std::function<std::string(std::size_t row, std::size_t finger, double value)>;

std::string plain(std::size_t, std::size_t, double value) { return fmt::format("{:.0f}", value); }

class RecalibrateFiles : public testing::Test {
 protected:
  RecalibrateFiles() {
    model::save(test_glove(), path("model.json"));
    request_.model = model::load(path("model.json"));
  }

  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }

  std::filesystem::path write(const std::string& name, const std::string& header, std::size_t columns,
                              double begin_s, double end_s,
                              const std::function<double(double, std::size_t)>& value,
                              const Cell& cell = plain, double clock_s = 0) {
    std::string text = "t_s," + header + "\n";
    std::size_t row = 0;
    for (double t = begin_s; t < end_s; t += kTestPeriod_s, ++row) {
      text += fmt::format("{:.3f}", t + clock_s);
      for (std::size_t i = 0; i < columns; ++i) text += "," + cell(row, i, value(t, i));
      text += "\n";
    }
    io::write_file(path(name), text);
    return path(name);
  }

  std::filesystem::path glove(const std::string& name, double begin_s, double end_s,
                              const Cell& cell = plain) {
    return write(
        name, "thumb,index,middle", 3, begin_s, end_s,
        [](double t, std::size_t i) { return reading(bend(t, i)); }, cell);
  }

  std::filesystem::path camera(double begin_s, double end_s) {
    return write(
        "camera.csv", "thumb_deg,index_deg", 2, begin_s, end_s,
        [](double t, std::size_t i) { return 90 * bend(t, i); },
        [](std::size_t, std::size_t, double v) { return fmt::format("{:.2f}", v); }, kCameraAhead_s);
  }

  // Both logs of the pair.
  void pair(const Cell& cell = plain) {
    request_.pair_sensor = glove("pair.csv", 0, 25, cell);
    request_.pair_camera = camera(0, 25);
  }

  Recalibration run() const { return recalibrate_files(request_); }

  void expect_refused(const std::string& why) const {
    const std::string message = io::refusal_of([&] { (void)run(); });
    EXPECT_NE(message.find(why), std::string::npos) << message;
  }

  // Alone it is not enough, and neither does it lose what a log of motion says.
  void expect_kept_until_there_is_motion() {
    const Recalibration r = run();
    EXPECT_FALSE(r.applied);
    EXPECT_FALSE(r.wanted.empty());
    EXPECT_EQ(model::to_json(r.model), io::read_file(path("model.json")));
    request_.recording = glove("motion.csv", 0, 30);
    EXPECT_TRUE(run().applied);
  }

  io::TemporaryFolder folder_;
  RecalibrationFiles request_;
};

TEST_F(RecalibrateFiles, TheJointsOwnSensorsDetermineACamerasClock) {
  pair();
  const Recalibration r = run();
  ASSERT_TRUE(r.clock);
  EXPECT_NEAR(r.clock->offset_s, kCameraAhead_s, 0.06) << "another finger's is a third of a second off";
  EXPECT_GT(r.clock->confidence, 0.9);
  EXPECT_TRUE(r.applied);
  EXPECT_EQ(to_json(r).at("clock_offset_s").get<double>(), r.clock->offset_s);
  EXPECT_EQ(to_json(r).at("alignment_confidence").get<double>(), r.clock->confidence);
}

TEST_F(RecalibrateFiles, ACameraOfAnotherTimeDoesNotCountAndLosesNothing) {
  request_.pair_sensor = glove("pair.csv", 0, 20);
  request_.pair_camera = camera(133, 153);
  expect_kept_until_there_is_motion();
  const Recalibration r = run();
  ASSERT_EQ(r.wanted.size(), 1U);
  EXPECT_NE(r.wanted[0].find("camera"), std::string::npos) << r.wanted[0];
  request_.pair_sensor = request_.pair_camera = "";
  const Recalibration alone = run();
  EXPECT_TRUE(to_json(alone).at("clock_offset_s").is_null());
  EXPECT_EQ(r.model, alone.model);
  EXPECT_GT(r.notes.size(), alone.notes.size()) << "and why";
}

TEST_F(RecalibrateFiles, ACameraThatSeesNoMotionIsWantedAgain) {
  request_.pair_sensor = glove("pair.csv", 0, 20);
  request_.pair_camera = write("flat.csv", "index_deg", 1, 0, 20, [](double, std::size_t) { return 30.0; });
  expect_kept_until_there_is_motion();
}

TEST_F(RecalibrateFiles, MapsThatMeanNothingAreRefused) {
  request_.recording = glove("motion.csv", 0, 30);
  request_.map = "index=index_deg";
  expect_refused("give --pair");
  request_.recording.clear();
  pair();
  request_.map = "index=index_deg,thumb=thumb_deg";
  expect_refused("accepted");
  request_.map = "index=thumb_deg,thumb=index_deg";
  expect_refused("with --map index=index_deg,thumb=thumb_deg");
  for (const char* map : {"index=index_deg,index=thumb_deg", "index=index_deg,thumb=index_deg"}) {
    request_.map = map;
    expect_refused("again");
  }
}

TEST_F(RecalibrateFiles, WhatIsWrongWithALogIsReportedAsWhatItIs) {
  const auto cell = [](std::size_t, std::size_t, double v) { return fmt::format("{:.4f}", v); };
  request_.recording = glove(
      "volts.csv", 0, 30, [&](std::size_t k, std::size_t i, double v) { return cell(k, i, v * 5 / 1023); });
  EXPECT_EQ(run().misfits.size(), 3U) << "the command says which ranges they are out of";
  std::string still = "t_s,thumb,index,middle\n";
  for (int row = 0; row < 90; ++row) still += fmt::format("7,{0},{0},{0}\n", 300 + row);
  io::write_file(path("still.csv"), still);
  request_.recording = path("still.csv");
  expect_refused("time does not increase: it is 7 s in every row");
  request_.recording.clear();
  request_.pair_sensor = glove("pair.csv", 0, 20);
  request_.pair_camera = write(
      "radians.csv", "index", 1, 0, 20, [](double t, std::size_t i) { return 1.57 * bend(t, i); }, cell);
  expect_refused("looks like radians: call it index_rad");
}

TEST_F(RecalibrateFiles, PosesAreReadAsIdentifyReadsThem) {
  const auto held = [](double t, std::size_t) {  // at ease, then each pose twice, the fists longer
    return reading(t < 1.5 ? 0.4 : t < 4 ? 0 : t < 8 ? 1 : t < 10 ? 0 : 1);
  };
  request_.poses = {"open", "fist"};
  request_.poses_log = write("held.csv", "thumb,index,middle", 3, 0, 14, held);
  EXPECT_NEAR(run().sensors[1].correction(450 - kMovedBy), 450, 12);
}

TEST_F(RecalibrateFiles, PosesThatAreNotFoundAreWantedAgain) {
  request_.poses = {"open", "fist"};
  request_.poses_log =
      write("held.csv", "thumb,index,middle", 3, 0, 6, [](double, std::size_t) { return reading(0); });
  expect_kept_until_there_is_motion();
}

TEST_F(RecalibrateFiles, ASensorThatReadsNothingLeavesTheOthers) {
  for (const std::string hole : {"nan", "", "NaN"}) {
    request_.recording = glove("motion.csv", 0, 30, [&](std::size_t row, std::size_t i, double v) {
      return i == 1 || (i == 2 && row == 40) ? hole : plain(row, i, v);
    });
    const Recalibration r = run();
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(r.sensors[i].applied, i != 1) << hole;
    ASSERT_EQ(r.misfits.size(), 1U) << hole;
    EXPECT_NE(r.misfits[0].find("index"), std::string::npos) << r.misfits[0];
  }
}

TEST_F(RecalibrateFiles, ACameraTellsWhatOneDeadSensorDoesNot) {
  pair([](std::size_t row, std::size_t i, double v) { return i == 1 ? "nan" : plain(row, i, v); });
  const Recalibration r = run();
  EXPECT_NEAR(r.clock->offset_s, kCameraAhead_s, 0.06);
  EXPECT_TRUE(r.sensors[0].applied);
  EXPECT_FALSE(r.sensors[1].applied);
}

TEST_F(RecalibrateFiles, PosesOfADeadSensorLeaveTheOthers) {
  const auto held = [](double t, std::size_t) { return reading(t < 3 ? 0 : 1); };
  request_.poses = {"open", "fist"};
  request_.poses_log =
      write("held.csv", "thumb,index,middle", 3, 0, 6, held, [](std::size_t row, std::size_t i, double v) {
        return i == 1 ? "0" : plain(row, i, v - (v > 400 ? 20 : 10));
      });
  const Recalibration r = run();
  EXPECT_EQ(r.sensors[1].correction.shift, 0) << "0 of many corrected";
  ASSERT_EQ(r.misfits.size(), 1U);
  EXPECT_NE(r.misfits[0].find("index"), std::string::npos) << r.misfits[0];
}

}  // namespace
}  // namespace flexor::identify
