#include "host/deploy/hardware.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "host/deploy/model_block.hpp"
#include "host/io/expect_test.hpp"
#include "host/model/compensator.hpp"

namespace flexor::deploy {
namespace hardware_test {

model::Model published_model() { return model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json"); }

TEST(OnHand, RefusesAModelOfMoreBitsThanTheBoardHas) {
  model::Model model = published_model();
  model.inputs[0].unit = "count";
  model.inputs[0].valid_max = 4094;
  std::vector<std::string> notes;
  io::expect_refused([&] { (void)on_hand(model, {}, notes); }, "counts to 4094");
  io::expect_refused([&] { (void)glove_for({}, model, {}); }, "counts to 4094");
}

TEST(OnHand, OpenComesUponOpenAndFistUponFist) {
  const model::Model model = published_model();
  std::vector<std::string> notes;
  EXPECT_EQ(on_hand(model, {}, notes), model) << "states no ends";
  model::Model turned = model;
  turned.joints[1].ends = model::Ends{113, 28};  // closes towards smaller angles
  EXPECT_GT(share_of_room(turned), share_of_room(model)) << "what turns it takes room too";
  turned = on_hand(turned, {}, notes);
  EXPECT_EQ(notes.size(), 1U);
  model::Model open_at_zero = model;
  open_at_zero.joints[1].ends = model::Ends{-0.2, 90};
  (void)on_hand(open_at_zero, {}, notes);
  EXPECT_EQ(notes.back().find("-0"), std::string::npos) << notes.back();
  model::Compensator<model::DoubleArithmetic> before(model);
  model::Compensator<model::DoubleArithmetic> after(turned);
  for (int k = 0; k < 50; ++k) {
    const std::vector<double> readings(kFingers, 40.0 + k);
    EXPECT_NEAR(after.step(readings)[1].angle_deg, 141 - before.step(readings)[1].angle_deg, 1e-9);
  }
}

TEST(OnHand, NoAngleIsBeyondTheHandsEnds) {
  model::Model model = published_model();
  for (model::Joint& joint : model.joints) {
    joint.ends = joint.name == "thumb" ? model::Ends{92, 168} : model::Ends{30, 110};
    std::get<model::Saturation>(std::ranges::find(model.blocks, joint.from, &model::Block::to)->kind) = {-50,
                                                                                                         250};
  }
  std::vector<std::string> notes;
  model = on_hand(model, {}, notes);
  EXPECT_EQ(model::limits(model, model.joints[0]), (model::Saturation{90, 170}));
  EXPECT_EQ(model::limits(model, model.joints[1]), (model::Saturation{28, 113}));
}

TEST(SafeHand, StaysOffItsEndsAndBelowTheSafeSpeed) {
  const model::Hardware hardware;
  const Hand hand = safe_hand(hardware, published_model(), {});
  for (std::size_t i = 0; i < kFingers; ++i) {
    EXPECT_EQ(hand.lower_deg[i], hardware.hand_lower_deg[i] + 2);
    EXPECT_EQ(hand.upper_deg[i], hardware.hand_upper_deg[i] - 2);
  }
  EXPECT_EQ(hand.hardware.loop_speed_deg_s, 400);
  EXPECT_LT(hand.hardware.loop_duty, hardware.loop_duty);
  EXPECT_EQ(unprotected_hand(hardware, published_model(), {}).hardware.loop_speed_deg_s, 800);
}

TEST(SafeHand, StaysWithinTheLoopsLimits) {
  model::Hardware hardware;
  hardware.loop_upper_deg = 100;
  const Hand hand = safe_hand(hardware, published_model(), {});
  for (std::size_t i = 0; i < kFingers; ++i) {
    EXPECT_EQ(hand.lower_deg[i], hardware.hand_lower_deg[i] + 2);
    EXPECT_EQ(hand.upper_deg[i], 98);
  }
}

TEST(SafeHand, RefusesMotorsThatCannotMoveWithinItsLimits) {
  model::Hardware hardware;
  hardware.source = "my.json";
  hardware.disturbance_mNm = 200;
  io::expect_refused([&] { (void)safe_hand(hardware, published_model(), {}); }, "my.json: motor.");
}

}  // namespace hardware_test
}  // namespace flexor::deploy
