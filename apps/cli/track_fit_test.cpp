// A joint file that does not fit the video gives no angles instead of zeros.
#include <algorithm>

#include "apps/cli/command_test.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cli {
namespace track_fit_test {

class TrackFit : public Command {
 protected:
  int run(const std::string& arguments) const { return Command::run(arguments).exit; }

  // What was said beside the progress, which says "tracking: frame".
  std::vector<std::string> lines() const {
    std::istringstream stream(content(folder_ / "stderr"));
    std::vector<std::string> out;
    for (std::string line; std::getline(stream, line);) {
      if (!line.starts_with("tracking: ")) out.push_back(line);
    }
    return out;
  }

  void expect_misfit(const std::string& video, const std::string& joints, const std::string& missing,
                     const std::string& options = " --seconds 3") const {
    EXPECT_EQ(run("track " + video + " --joints " + joints + " --out a.csv --preview p.mp4" + options), 1);
    ASSERT_EQ(lines().size(), 1u) << content(folder_ / "stderr");
    EXPECT_NE(lines()[0].find("does not fit"), std::string::npos) << lines()[0];
    EXPECT_NE(lines()[0].find(missing), std::string::npos) << lines()[0];
    EXPECT_NE(lines()[0].find("--setup"), std::string::npos) << lines()[0];
    EXPECT_EQ(content(folder_ / "stdout"), "");
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(name.find("a.csv") == std::string::npos && name.find("p.mp4") == std::string::npos) << name;
    }
  }

  void film() const { ASSERT_EQ(run("camera film --gestures 4 --set camera.rate_hz=2 --out film"), 0); }

  // The film's joint file with the marks of some skeletons said to be blue.
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
  film();
  const std::string video = "film/video.mp4";
  expect_misfit(video, blue("all.json", {"thumb", "index", "middle", "ring", "pinky"}), "thumb: ");
  expect_misfit(video, blue("most.json", {"thumb", "middle", "ring", "pinky"}), "thumb: ");

  // One finger out of five: the others are measured, and its quality says lost.
  EXPECT_EQ(run("track " + video + " --joints " + blue("one.json", {"pinky"}) + " --out a.csv --seconds 3"),
            0);
  EXPECT_TRUE(
      std::ranges::any_of(lines(), [](const std::string& l) { return l.starts_with("warning: pinky:"); }));
  const auto angles = recording::read_csv(folder_ / "a.csv", {"pinky_mcp_quality", "index_mcp_quality"});
  EXPECT_TRUE(std::ranges::all_of(angles.column("pinky_mcp_quality").value, [](double q) { return q == 3; }));
  EXPECT_TRUE(std::ranges::all_of(angles.column("index_mcp_quality").value, [](double q) { return q < 3; }));
}

TEST_F(TrackFit, AFiveFingerFileOnTwoFingersIsRefusedThoughSomeDotsLookLikeAFinger) {
  const fs::path video = fs::absolute(FLEXOR_SOURCE_DIR "/../shared/data/video/green_markers.mp4");
  if (!fs::exists(video)) GTEST_SKIP() << "needs ../shared/data/video, which is not part of the repository";
  expect_misfit(quoted(video.string()),
                quoted(fs::absolute(FLEXOR_SOURCE_DIR "/models/joints/paper_hand.json").string()),
                "thumb: ", "");
}

}  // namespace track_fit_test
}  // namespace flexor::cli
