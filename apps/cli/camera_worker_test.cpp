// What comes out of the camera's worker: as good as exact angles, whole or not at all, and gone with its caller.

#include "apps/cli/command_test.hpp"
#include "host/identify/identify.hpp"
#include "host/io/worker.hpp"
#include "host/study/boards.hpp"
#include "host/study/builtin.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/exact_json.hpp"

namespace flexor::cli {
namespace camera_worker_test {

class Rendered : public Command {
 protected:
  // The calibration motion, and these gestures if any.
  void film(const std::string& gestures, double rate_hz) const {
    std::vector<twin::Motion> motions = {study::short_motion()};
    if (!gestures.empty())
      for (twin::Motion& m : study::motions(gestures)) motions.push_back(m);
    twin::Parameters parameters;
    parameters.camera_rate_hz = rate_hz;
    Json inputs = Json::array();
    for (const twin::Motion& motion : motions)
      inputs.push_back(twin::TrialInput{parameters, motion, study::compensator("raw", 50).model, 1, true});
    io::Worker camera(FLEXOR_CAMERA);
    camera.run("film", {{"inputs", inputs},
                        {"joints", Json::parse(study::builtin("joints/paper_hand.json"))},
                        {"seed", 1},
                        {"folder", folder_.string()}});
  }

  Json track_arguments() const {
    return {{"video", path("video.mp4")}, {"joints", path("joints.json")},  {"lens", ""},  {"report", ""},
            {"out", path("angles.csv")},  {"preview", path("preview.mp4")}, {"seconds", 0}};
  }
};

// Log and video of one motion on two clocks, straight to a compensator; beside it the one from exact angles.
TEST_F(Rendered, ACompensatorFromAVideoIsAsGoodAsOneFromExactAngles) {
  film("5", twin::Parameters().camera_rate_hz);
  io::Worker camera(FLEXOR_CAMERA);
  const Json tracked = camera.run("track", track_arguments());
  EXPECT_EQ(tracked.at("frames_labelled"), tracked.at("frames"));
  std::array<double, 2> fit{};
  std::array<double, 2> offset{};
  for (std::size_t i = 0; i < 2; ++i) {
    identify::Request r;
    r.pairs = {{path("glove.csv"), path(i == 0 ? "truth.csv" : "angles.csv")}};
    r.map = {{"index", {"index_alpha"}, "index_mcp_deg"}};
    r.structure = "hammerstein";
    const identify::Result result = identify::identify_files(r, {});
    fit[i] = result.joints[0].holdout.fit_percent;
    offset[i] = result.clocks[0].offset_s;
  }
  EXPECT_NEAR(fit[1], fit[0], 1);
  EXPECT_GT(fit[1], 90);
  EXPECT_LT(fit[1], 99.9);
  EXPECT_NEAR(offset[1], offset[0], 0.02);
}

TEST_F(Rendered, TheExperimentThroughPicturesScoresAsTheExperimentWithAngles) {
  study::Plan plan;
  plan.motions = study::motions("4");
  plan.compensators = {study::compensator("published-hw", 10)};
  plan.trials = 1;
  const double angles = study::run(plan, {}).cell(0, 0).total_deg_s.mean();
  study::RenderedCameras cameras(FLEXOR_CAMERA, nullptr);
  plan.engine = &cameras;
  const double pictures = study::run(plan, {}).cell(0, 0).total_deg_s.mean();
  EXPECT_NEAR(pictures, angles, 0.05 * angles);
  EXPECT_NE(pictures, angles);
}

// What Ctrl-C does to the track of a camera, which has no end of its own.
TEST_F(Rendered, ATrackThatIsStoppedKeepsWhatItHas) {
  film("", 5);
  io::Worker camera(FLEXOR_CAMERA);
  const Json whole = camera.run("track", track_arguments());
  const std::string all = io::read_file(path("angles.csv"));
  const Json stopped =
      camera.run("track", track_arguments(), [](const io::Progress& p) { return p.done < 5; });
  EXPECT_LT(stopped.at("frames"), whole.at("frames"));
  EXPECT_GE(stopped.at("frames"), 5);
  EXPECT_LT(io::read_file(path("angles.csv")).size(), all.size());
  EXPECT_TRUE(fs::exists(path("preview.mp4")));
  for (const auto& entry : fs::directory_iterator(folder_))
    EXPECT_EQ(entry.path().filename().string().find(".part-"), std::string::npos) << entry;
}

}  // namespace camera_worker_test
}  // namespace flexor::cli
