// The worker's live jobs as a program sees them: drawn pictures in, their angles out.
#include "apps/camera/live_jobs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "host/camera/jpeg.hpp"
#include "host/io/base64.hpp"
#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/model/model.hpp"

namespace flexor::filming {
namespace {

constexpr double kRate_hz = 15;

struct LiveJobs {
  std::map<std::string, io::Job> all = live_jobs();
  Json open(const Json& json) { return all.at("watch_open")(json, {}); }
  Json picture(const Json& json) { return all.at("watch_picture")(json, {}); }
  Json close() { return all.at("watch_close")(Json::object(), {}); }
  Json draw(const Json& json) { return all.at("draw_picture")(json, {}); }
};

Json joints() { return Json::parse(io::read_file(FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json")); }

std::vector<double> pose(double t_s) {
  std::vector<double> out;
  for (int i = 0; i < twin::kFingers; ++i)
    out.push_back((i == 0 ? 115 : 60) + (i == 0 ? 20 : 30) * std::sin(1.5 * t_s + 0.4 * i));
  return out;
}

Json picture(LiveJobs& jobs, int k) {
  const Json drawn = jobs.draw({{"mcp_deg", pose(k / kRate_hz)}, {"frame", k}});
  return {{"t_s", k / kRate_hz}, {"jpeg", drawn.at("jpeg")}};
}

// Where that finger's knuckle is among the angles.
std::size_t knuckle(const Json& opened, std::size_t finger) {
  const auto names = opened.at("angles").get<std::vector<std::string>>();
  const auto found = std::ranges::find(names, model::finger_names()[finger] + "_mcp");
  return static_cast<std::size_t>(found - names.begin());
}

TEST(LiveJobs, WhatIsRefusedEndsNothing) {
  LiveJobs jobs;
  io::expect_refused([&] { jobs.picture(picture(jobs, 0)); }, "watch_open comes first");
  jobs.open({{"joints", joints()}});
  for (int k = 0; k < 3; ++k) jobs.picture(picture(jobs, k));
  Json bad = picture(jobs, 3);
  bad["jpeg"] = "no base64";
  io::expect_refused([&] { jobs.picture(bad); }, "base64");
  bad["jpeg"] = io::base64("hello");
  io::expect_refused([&] { jobs.picture(bad); }, "no JPEG");
  bad["jpeg"] = std::string(3 * camera::kMostJpegBytes, 'A');
  io::expect_refused([&] { jobs.picture(bad); }, "base64");
  const Json small = {
      {"t_s", 3 / kRate_hz},
      {"jpeg", io::base64(camera::to_jpeg(camera::Picture(360, 640, CV_8UC3, cv::Scalar())))}};
  io::expect_refused([&] { jobs.picture(small); }, "640 x 360 pixels, those before it 960 x 540");
  io::expect_refused([&] { jobs.picture(picture(jobs, 2)); }, "grow by a millisecond");
  Json early = picture(jobs, 3);
  early["t_s"] = -1;
  io::expect_refused([&] { jobs.picture(early); }, "between 0 and");
  for (int k = 3; k < 6; ++k) jobs.picture(picture(jobs, k));
  EXPECT_EQ(jobs.close().at("rows").size(), 6U);
  io::expect_refused([&] { jobs.close(); }, "watch_open comes first");
}

TEST(LiveJobs, APictureWithoutAHandHasNoAngles) {
  LiveJobs jobs;
  jobs.open({{"joints", joints()}});
  const camera::Picture grey(360, 640, CV_8UC3, cv::Scalar::all(128));
  for (int k = 0; k < 20; ++k) {
    const Json seen = jobs.picture({{"t_s", k / kRate_hz}, {"jpeg", io::base64(camera::to_jpeg(grey))}});
    EXPECT_EQ(seen.at("marks_found"), 0);
    for (const Json& row : seen.at("rows")) EXPECT_EQ(row.at("quality").at(0), 3);
  }
}

// What a browser's canvas sends of a camera: 960 pixels drawn into 640, where a mark's green runs into the skin that it lies on.
TEST(LiveJobs, MarksInSmallPicturesAreFollowedWhereverTheyBegin) {
  constexpr int kPictures = 60;
  constexpr int kQuality = 82;
  for (const double begin_s : {0.0, 0.7, 1.9, 2.6}) {
    LiveJobs jobs;
    const Json opened = jobs.open({{"joints", joints()}, {"drawn", true}});
    double worst_deg = 0;
    for (int k = 0; k < kPictures; ++k) {
      const double t_s = begin_s + k / kRate_hz;
      const Json drawn = jobs.draw({{"mcp_deg", pose(t_s)}, {"frame", k}});
      const camera::Picture large = camera::from_jpeg(*io::from_base64(drawn.at("jpeg").get<std::string>()));
      camera::Picture small;
      cv::resize(large, small, {2 * large.cols / 3, 2 * large.rows / 3}, 0, 0, cv::INTER_AREA);
      const std::string jpeg = camera::to_jpeg(small, kQuality);
      const Json seen = jobs.picture({{"t_s", t_s}, {"jpeg", io::base64(jpeg)}});
      for (const Json& row : seen.at("rows")) {
        for (std::size_t i = 0; i < twin::kFingers; ++i) {
          const std::size_t at = knuckle(opened, i);
          ASSERT_NE(row.at("quality").at(at), 3) << "begun at " << begin_s << ", lost at " << row.at("t_s");
          worst_deg =
              std::max(worst_deg, std::abs(row.at("deg").at(at).get<double>() - pose(row.at("t_s"))[i]));
        }
      }
    }
    EXPECT_LT(worst_deg, 3) << "begun at " << begin_s;
    EXPECT_GT(worst_deg, 0.05);
  }
}

// From end to end and as quickly as a person does it, in pictures of a machine that is busy: some come 0.1 to 0.3 s late.
TEST(LiveJobs, AFingerThatIsTakenForAnotherPartOfItselfIsNotForLong) {
  const auto quick = [](double t_s) {
    std::vector<double> out;
    for (int i = 0; i < twin::kFingers; ++i) {
      const double share = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * 1.3 * (t_s + 0.03 * i));
      out.push_back(i == 0 ? 90 + 80 * share : 28 + 85 * share);
    }
    return out;
  };
  std::size_t angles = 0;
  std::size_t sure = 0;
  std::size_t wrong = 0;
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    std::mt19937 random(seed);
    LiveJobs jobs;
    const Json opened = jobs.open({{"joints", joints()}, {"drawn", true}});
    double t_s = 0;
    for (int k = 0; k < 150; ++k) {
      const Json drawn = jobs.draw({{"mcp_deg", quick(t_s)}, {"frame", k}});
      const Json seen = jobs.picture({{"t_s", t_s}, {"jpeg", drawn.at("jpeg")}});
      for (const Json& row : seen.at("rows")) {
        for (std::size_t i = 0; i < twin::kFingers; ++i) {
          const std::size_t at = knuckle(opened, i);
          ++angles;
          if (row.at("quality").at(at) == 3 || row.at("se_deg").at(at) > 3) continue;
          ++sure;
          if (std::abs(row.at("deg").at(at).get<double>() - quick(row.at("t_s"))[i]) > 10) ++wrong;
        }
      }
      t_s += random() % 10 == 0 ? 0.1 + 0.02 * static_cast<double>(random() % 11) : 1 / kRate_hz;
    }
  }
  std::printf("%zu angles, %zu of them sure, %zu of those wrong\n", angles, sure, wrong);
  EXPECT_GT(10 * sure, 9 * angles);
  EXPECT_LT(500 * wrong, angles);
}

}  // namespace
}  // namespace flexor::filming
