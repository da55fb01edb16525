#include "apps/live/recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "host/identify/recalibrate_files.hpp"

namespace flexor::live {
namespace {

// Its sensors are called as the columns of a glove's log, its joints as fingers.
model::Model five() {
  model::Model out = model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json");
  for (std::size_t i = 0; i < out.inputs.size(); ++i) {
    const std::string before = std::exchange(out.inputs[i].name, out.joints[i].name + "_count");
    for (model::Block& block : out.blocks) std::ranges::replace(block.from, before, out.inputs[i].name);
  }
  model::check(out);
  return out;
}

identify::Recalibration answer(const model::Model& model) {
  identify::Recalibration out;
  out.applied = true;
  for (const model::Input& input : model.inputs) {
    identify::RecalibratedSensor& sensor = out.sensors.emplace_back();
    sensor.name = input.name;
    sensor.applied = true;
  }
  for (const model::Joint& joint : model.joints) out.joints.push_back({joint.name, 8, 8, 2});
  return out;
}

std::string verdict(const RedonningResult& result, std::size_t finger) {
  return result.fingers.at(finger).at("verdict").get<std::string>();
}

TEST(RedonningStep, EachEventInEachStep) {
  using enum RedonningStep;
  const std::vector<std::pair<RedonningEvent, std::vector<RedonningStep>>> rows = {
      {RedonningEvent::starts, {motion, motion, fits, answer}},
      {RedonningEvent::moved, {none, fits, fits, answer}},
      {RedonningEvent::fitted, {none, motion, answer, answer}},
      {RedonningEvent::ends, {none, none, none, none}}};
  for (const auto& [event, next] : rows) {
    for (const RedonningStep step : {none, motion, fits, answer})
      EXPECT_EQ(after(step, event), next[static_cast<std::size_t>(step)]);
  }
}

TEST(Redonning, GivesEachFingerTheVerdictOnItsOwnSensor) {
  const model::Model model = five();
  identify::Recalibration report = answer(model);
  const auto keep = [&](std::size_t i, const std::string& why) {
    report.sensors[i].applied = false;
    report.sensors[i].kept = why;
  };
  keep(1, "index_count: it stands still at 470");
  report.misfits.push_back(report.sensors[1].kept);
  keep(2, "middle_count: open and close it once more");
  report.wanted.push_back(report.sensors[2].kept);
  keep(3, "ring_count: it reads as it did where the model was made");
  const RedonningResult result = result_of(model, identify::to_json(report));
  EXPECT_TRUE(result.applied);
  EXPECT_TRUE(result.is_off);
  EXPECT_EQ(result.fingers.at(0).at("name"), "thumb");
  EXPECT_EQ(result.fingers.at(0).at("before_deg"), 8);
  EXPECT_EQ(result.fingers.at(0).at("after_deg"), 2);
  EXPECT_EQ(verdict(result, 0), "fitted");
  EXPECT_EQ(verdict(result, 1), "does not fit: it stands still at 470");
  EXPECT_EQ(verdict(result, 2), "wanted: open and close it once more");
  EXPECT_EQ(verdict(result, 3), "kept: it reads as it did where the model was made");
  EXPECT_EQ(verdict(result, 4), "fitted");
  for (const std::size_t kept : {1U, 2U, 3U})
    EXPECT_TRUE(result.fingers.at(kept).at("before_deg").is_null()) << "not changed is not right";
  EXPECT_EQ(result.misfits, "index_count: it stands still at 470");
  EXPECT_EQ(result.wanted, "middle_count: open and close it once more");
}

TEST(Redonning, AnErrorThatIsNotKnownIsNull) {
  const model::Model model = five();
  Json report = identify::to_json(answer(model));
  report["se_deg"]["thumb"] = nullptr;
  EXPECT_TRUE(result_of(model, report).fingers.at(0).at("after_deg").is_null());
}

}  // namespace
}  // namespace flexor::live
