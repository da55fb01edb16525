// The worker through its pipe: what is drawn there is seen there.
#include "apps/live/camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host/io/io.hpp"

namespace flexor::live {
namespace {

constexpr double kRate_hz = 15;

twin::PerFinger pose(double t_s) {
  twin::PerFinger out{};
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = (i == 0 ? 115 : 60) + 20 * std::sin(1.5 * t_s + 0.4 * static_cast<double>(i));
  return out;
}

std::size_t index_of(const Camera& camera, const std::string& name) {
  return static_cast<std::size_t>(std::ranges::find(camera.angles(), name) - camera.angles().begin());
}

TEST(Camera, SeesWhatItDraws) {
  Camera camera(FLEXOR_CAMERA);
  camera.open("paper_hand", {}, true);
  const std::size_t index = index_of(camera, "index_mcp");
  ASSERT_LT(index, camera.angles().size());
  std::vector<SeenRow> rows;
  constexpr int kFrames = 40;
  const auto begin = std::chrono::steady_clock::now();
  for (int k = 0; k < kFrames; ++k) {
    const double t_s = k / kRate_hz;
    const Seen seen = camera.picture(t_s, camera.draw(pose(t_s), static_cast<std::uint64_t>(k)));
    EXPECT_EQ(seen.marks_found, 24);
    EXPECT_EQ(seen.marks, 24);
    EXPECT_EQ(seen.width, 960);
    EXPECT_EQ(seen.height, 540);
    rows.insert(rows.end(), seen.rows.begin(), seen.rows.end());
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  RecordProperty("ms_a_picture", std::to_string(1000 * took.count() / kFrames));
  const std::vector<SeenRow> last = camera.close();
  rows.insert(rows.end(), last.begin(), last.end());
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kFrames));
  for (const SeenRow& row : rows) {
    EXPECT_NEAR(row.deg[index], pose(row.t_s)[1], 1);
    EXPECT_LT(row.se_deg[index], 1);
  }
}

TEST(Camera, EveryJointFileThatItCarriesOpens) {
  Camera camera(FLEXOR_CAMERA);
  for (const std::string& name : joint_files()) {
    camera.open(name);
    EXPECT_FALSE(camera.angles().empty()) << name;
  }
  EXPECT_THROW(camera.open("no_such_file.json"), io::InputError);
}

TEST(Camera, GarbageEndsNothing) {
  Camera camera(FLEXOR_CAMERA);
  camera.open("paper_hand");
  camera.picture(0, camera.draw(pose(0), 0));
  EXPECT_THROW(camera.picture(1, "no picture"), io::InputError);
  EXPECT_THROW(camera.picture(0, camera.draw(pose(0), 1)), io::InputError);
  EXPECT_THROW(camera.grab("no_such_video.mp4"), io::InputError);
  camera.picture(1, camera.draw(pose(1), 1));
  EXPECT_EQ(camera.close().size(), 2U);
}

}  // namespace
}  // namespace flexor::live
