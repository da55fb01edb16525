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
    c.valid_min = 0;
    c.valid_max = 1023;
    c.saturation = {0, 113};
    model::add(m, c);
  }
  return m;
}

// Of these angles of the model's joints.
WholeHand hand_of(const model::Model& model, const std::vector<double>& joints_deg) {
  HandView view(model);
  view.add(1, joints_deg);
  for (;;) {
    if (const std::optional<WholeHand> hand = view.poll()) return *hand;
    std::this_thread::yield();
  }
}

double knuckle_deg(const WholeHand& hand, const char* joint) {
  return hand.angle_deg[*posture::find_joint(joint)];
}

TEST(HandView, DrawsWhatIsMeasuredAlsoWhereItIsUnlikely) {
  const WholeHand hand = hand_of(model_of({"index", "middle", "ring", "pinky"}), {0, 90, 0, 0});
  EXPECT_DOUBLE_EQ(knuckle_deg(hand, "middle_mcp"), 90) << "one finger alone, bent all the way";
  EXPECT_DOUBLE_EQ(knuckle_deg(hand, "index_mcp"), 0);
}

TEST(HandView, AJointThatAModelHasTwiceCountsOnce) {
  const model::Model twice = model_of({"index", "index_mcp"});
  EXPECT_EQ(hand_inputs(twice).size(), 1U);
  EXPECT_DOUBLE_EQ(knuckle_deg(hand_of(twice, {30, 50}), "index_mcp"), 30);
}

}  // namespace
}  // namespace flexor::live
