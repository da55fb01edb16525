// A joint file that does not fit the video gives no angles instead of zeros.

#include "apps/cli/command_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace track_fit_test {

class TrackFit : public Command {
 protected:
  void expect_misfit(const std::string& video, const std::string& joints, int never_found) const {
    const std::string says =
        fmt::format("{} does not fit it: {} of its 24 marks were never found (thumb: ", joints, never_found);
    expect_refused("track " + video + " --joints " + joints + " --out a.csv --preview p.mp4", 1, says);
  }

  // The film's joint file with the marks of some skeletons given as blue.
  std::string blue(const std::string& name, const std::vector<std::string>& skeletons) const {
    auto json = nlohmann::json::parse(content(folder_ / "film/joints.json"));
    for (auto& s : json.at("skeletons")) {
      if (std::ranges::find(skeletons, s.at("name").get<std::string>()) == skeletons.end()) continue;
      s.at("marks")["colour"] = "#1010f0";
      s.at("marks").erase("start");
    }
    write(name, json.dump());
    return name;
  }
};

TEST_F(TrackFit, MarksOfAnotherColourAreNamedAndNothingIsWritten) {
  ASSERT_EQ(run("camera film --gestures 4 --set camera.rate_hz=2 --out film").exit, 0);
  const std::string video = "film/video.mp4";
  expect_misfit(video, blue("all.json", {"thumb", "index", "middle", "ring", "pinky"}), 24);
  expect_misfit(video, blue("most.json", {"thumb", "middle", "ring", "pinky"}), 19);

  // One finger out of five: the others are measured, and its quality says lost.
  const Finished r = run("track " + video + " --joints " + blue("one.json", {"pinky"}) + " --out a.csv");
  EXPECT_EQ(r.exit, 0);
  EXPECT_NE(r.err.find("warning: pinky:"), std::string::npos) << r.err;
  const auto angles = recording::read_csv(folder_ / "a.csv", {"pinky_mcp_quality", "index_mcp_quality"});
  EXPECT_TRUE(std::ranges::all_of(angles.column("pinky_mcp_quality").value, [](double q) { return q == 3; }));
  EXPECT_TRUE(std::ranges::all_of(angles.column("index_mcp_quality").value, [](double q) { return q < 3; }));
}

TEST_F(TrackFit, AFiveFingerFileOnTwoFingersIsRefusedThoughSomeDotsLookLikeAFinger) {
  const fs::path video = fs::absolute(FLEXOR_SOURCE_DIR "/../shared/data/video/green_markers.mp4");
  if (!fs::exists(video)) GTEST_SKIP() << "needs ../shared/data/video, which is not part of the repository";
  expect_misfit(video.string(), fs::absolute(FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json").string(),
                19);
}

}  // namespace track_fit_test
}  // namespace flexor::cli
