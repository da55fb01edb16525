#include "apps/live/hand_view.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "host/model/channel.hpp"

namespace flexor::live {
namespace {

model::Model model_of(const std::vector<std::string>& joints) {
  model::Model m;
  m.sample_period_s = 0.1;
  for (const std::string& joint : joints) {
    model::Channel c;
    c.name = joint;
    c.input_column = joint + "_count";
    c.valid_max = 1023;
    c.saturation = {0, 113};
    model::add(m, c);
  }
  return m;
}

// Of a joint, where the model's have these angles.
double bend_deg(const char* joint, const model::Model& model, const std::vector<double>& joints_deg) {
  HandView view(model);
  view.add(1, joints_deg);
  for (;;) {
    if (const auto hand = view.poll()) return hand->angle_deg[*posture::find_joint(joint)];
    std::this_thread::yield();
  }
}

const model::Model kFour = model_of({"index", "middle", "ring", "pinky"});

TEST(HandView, DrawsWhatIsMeasuredAlsoWhereItIsUnlikely) {
  EXPECT_DOUBLE_EQ(bend_deg("middle_mcp", kFour, {0, 90, 0, 0}), 90) << "one finger alone, bent all the way";
  EXPECT_DOUBLE_EQ(bend_deg("index_mcp", kFour, {0, 90, 0, 0}), 0);
}

TEST(HandView, AThumbThatIsNotMeasuredBendsWithTheFist) {
  EXPECT_GT(bend_deg("thumb_mcp", kFour, {90, 90, 90, 90}), bend_deg("thumb_mcp", kFour, {0, 0, 0, 0}) + 5);
}

TEST(HandView, AJointThatAModelHasTwiceCountsOnce) {
  const model::Model twice = model_of({"index", "index_mcp"});
  EXPECT_EQ(hand_inputs(twice).size(), 1U);
  EXPECT_DOUBLE_EQ(bend_deg("index_mcp", twice, {30, 50}), 30);
}

}  // namespace
}  // namespace flexor::live
