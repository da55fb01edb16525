#include "host/twin/exact_json.hpp"

#include <gtest/gtest.h>

#include "host/io/io.hpp"

namespace flexor::twin {
namespace {

TEST(ExactJson, ATrialThatCameThroughAPipeIsPlayedToTheSameBits) {
  TrialInput input;
  input.parameters.noise_deg = 1.0 / 3;
  input.parameters.faults.push_back({2, FaultKind::loose, 0.1, 1.0 / 7});
  input.motion = Motion::from_json(io::read_file(FLEXOR_SOURCE_DIR "/models/gestures/4.json"), "4.json");
  input.compensator = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  input.seed = UINT64_MAX - 5;
  input.record_samples = true;
  const Motion wave = Motion::from_samples(
      "wave", {0, 1.0 / 3, 2}, {{{30, 0.1, 99}, {30, 60, 90}, {30, 60, 90}, {30, 60, 90}, {30, 60, 90}}});
  input.worn = Worn{wave, 10.0 / 3, 0};
  input.tracking = Tracking{};
  input.tracking->sensor[1] = model::TrackedRange{{300, 700}, 85, 150, 850};
  const auto back = Json::parse(Json(input).dump()).get<TrialInput>();
  EXPECT_EQ(Json(back), Json(input));
  const Trial trial = simulate(input, 3, 1).front();
  ASSERT_GT(trial.sample_s.size(), 50U);
  EXPECT_TRUE(simulate(back, 3, 1).front() == trial);
  EXPECT_TRUE(Json::parse(Json(trial).dump()).get<Trial>() == trial);
}

}  // namespace
}  // namespace flexor::twin
