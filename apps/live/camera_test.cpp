// The worker through its pipe; what it sees, and refuses, is tested where it is (apps/camera/live_jobs_test.cpp).
#include "apps/live/camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "host/io/io.hpp"

namespace flexor::live {
namespace {

TEST(Camera, SeesWhatItDrawsAndGoesOnAfterGarbage) {
  Camera camera(FLEXOR_CAMERA);
  camera.open("paper_hand", {}, true);
  const auto index = std::ranges::find(camera.angles(), "index_mcp") - camera.angles().begin();
  const twin::PerFinger pose = {115, 60, 60, 60, 60};
  constexpr int kFrames = 4;
  for (int k = 0; k < kFrames; ++k) {
    const Seen seen = camera.picture(k / 15.0, camera.draw(pose, static_cast<std::uint64_t>(k)));
    EXPECT_EQ(seen.marks_at.size(), 24U);
    EXPECT_EQ(seen.width, 960);
    EXPECT_THROW(camera.picture(1, "no picture"), io::InputError);
    EXPECT_THROW(camera.grab("no_such_video.mp4"), io::InputError);
  }
  const std::vector<SeenRow> rows = camera.close();
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kFrames));
  EXPECT_NEAR(rows[2].deg.at(static_cast<std::size_t>(index)), 60, 1);
  EXPECT_LT(rows[2].se_deg.at(static_cast<std::size_t>(index)), 1);
}

TEST(Camera, EveryJointFileThatItCarriesOpens) {
  Camera camera(FLEXOR_CAMERA);
  for (const std::string& name : joint_files()) {
    camera.open(name);
    EXPECT_FALSE(camera.angles().empty()) << name;
  }
  EXPECT_THROW(camera.open("no_such_file.json"), io::InputError);
}

}  // namespace
}  // namespace flexor::live
