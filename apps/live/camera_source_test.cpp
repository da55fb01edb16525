#include "apps/live/camera_source.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "host/io/io.hpp"

namespace flexor::live {
namespace {

using listen::Event;
using listen::Sample;

// Twenty pictures at 30 a second: mcp angles 10 + k of the fingers, 100 + k of the thumb (test_inputs).
std::string video() {
  static const io::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "video.mp4";
  if (!std::filesystem::exists(file)) {
    const std::string command = std::string(FLEXOR_TEST_INPUTS) + " " + folder.path().string();
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c): a command of this test's own
  }
  return file.string();
}

// By a clock on which each picture but the third comes so long after it was taken, and the third later. By the wall's none
// comes before it would have been taken.
TEST(CameraSource, GivesTheAnglesOfAVideoAtTheTimesOfItsPictures) {
  const auto begin = std::chrono::steady_clock::now();
  int pictures = 0;
  CameraSource source(video(), "paper_hand", {}, FLEXOR_CAMERA, [&pictures] {
    const int k = pictures++;
    return 3 + k / 30.0 + (k == 2 ? 0.5 : 0);
  });
  ASSERT_EQ(source.columns().size(), 28U);
  EXPECT_EQ(source.columns()[2], "index_mcp_deg");
  EXPECT_EQ(source.columns()[16], "index_mcp_quality");
  EXPECT_NE(source.description().find("960 x 540"), std::string::npos);
  std::vector<Sample> samples;
  while (source.wait(0.1, samples) != Event::ended) continue;
  ASSERT_EQ(samples.size(), 20U);
  EXPECT_EQ(source.tally().samples, 20U);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const auto number = static_cast<double>(k);
    EXPECT_NEAR(samples[k].value[2], 10 + number, 1);
    EXPECT_EQ(samples[k].value[16], 0);
    EXPECT_EQ(samples[k].remark[2], "");
    EXPECT_NEAR(*samples[k].board_s, number / 30, 1e-3);
    EXPECT_NEAR(samples[k].host_s, 3 + number / 30, 1e-3);  // rows come later, the last twelve together
  }
  EXPECT_EQ(pictures, 20);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(19 * 1000 / 30 - 50));
}

TEST(CameraSource, RefusesWhatItCannotWatch) {
  EXPECT_THROW(CameraSource("no_such_video.mp4", "paper_hand", {}, FLEXOR_CAMERA), io::InputError);
  EXPECT_THROW(CameraSource(video(), "no_such_joints.json", {}, FLEXOR_CAMERA), io::InputError);
  EXPECT_THROW(CameraSource(video(), "paper_hand", "no_such_lens.json", FLEXOR_CAMERA), io::InputError);
}

// Long before the video is over.
TEST(CameraSource, EndsWhenItIsLeft) {
  const auto begin = std::chrono::steady_clock::now();
  { CameraSource source(video(), "paper_hand", {}, FLEXOR_CAMERA); }
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 5);
}

}  // namespace
}  // namespace flexor::live
