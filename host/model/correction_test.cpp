#include "host/model/correction.hpp"

#include <gtest/gtest.h>

#include "host/io/io.hpp"
#include "host/model/compensator.hpp"

namespace flexor::model {
namespace {

// A finger whose sensor falls from 700 counts at 10 degrees to 300 at 90.
Model falling(const std::string& unit) {
  Model m;
  m.sample_period_s = 0.05;
  m.inputs.push_back({"adc", "adc", unit, "index", 1, 1022});
  m.inputs[0].poses = Poses{690, 310};
  m.inputs[0].readings = Spread{{0.02, 0.5, 0.98}, {310, 500, 690}};
  m.inputs[0].donnings = DonningSpread{3, 20, 0.1};
  m.blocks.push_back({{"adc"}, "curve", Curve{{300, 700}, {90, 10}}});
  m.blocks.push_back({{"curve"}, "angle", Saturation{0, 100}});
  m.joints.push_back({"index", "angle", 10});
  return m;
}

template <class Arithmetic>
double angle(const Model& model, double reading) {
  return Compensator<Arithmetic>(model).step(reading).angle_deg;
}

TEST(Correction, ACorrectedModelReadsTheSensorAsItWasMade) {
  const Correction moved{1.1, -60};
  const Model now = corrected(falling("count"), 0, moved);
  EXPECT_EQ(correction_of(now, 0), moved);
  for (const double made : {320.0, 410.5, 666.0}) {
    const double was = angle<DoubleArithmetic>(falling("count"), made);
    EXPECT_NEAR(angle<DoubleArithmetic>(now, moved.inverse(made)), was, 1e-9);
    EXPECT_NEAR(angle<FixedArithmetic>(now, moved.inverse(made)), was, 0.06);
  }
  EXPECT_EQ(from_json(to_json(now), "it"), now);
}

TEST(Correction, AnotherOneGoesBeforeTheFirst) {
  const Model once = corrected(falling("count"), 0, {1.1, -60});
  const Model twice = corrected(once, 0, {0.9, 20});
  EXPECT_EQ(twice.blocks.size(), once.blocks.size());
  for (const double reading : {350.0, 500.0, 600.0}) {
    EXPECT_NEAR(angle<DoubleArithmetic>(twice, reading), angle<DoubleArithmetic>(once, 0.9 * reading + 20),
                1e-9);
  }
}

TEST(Correction, WhatTheSensorReadAtPosesIsGivenAsItReadsNow) {
  const Model now = corrected(falling("count"), 0, {1, -60});
  EXPECT_DOUBLE_EQ(now.inputs[0].poses->open, 750);
  EXPECT_DOUBLE_EQ(now.inputs[0].readings->reading.front(), 370);
  EXPECT_DOUBLE_EQ(now.inputs[0].valid_max, 1022) << "the converter's rails stay";
  EXPECT_DOUBLE_EQ(corrected(falling("V"), 0, {1, -60}).inputs[0].valid_max, 1082);
}

TEST(Correction, FoldedThereIsNoBlockAndTheLineIsGivenApart) {
  const Correction moved{1.05, 12};
  const Folded board = folded(corrected(falling("count"), 0, moved));
  ASSERT_EQ(board.correction.size(), 1U);
  EXPECT_EQ(board.correction[0], moved);
  EXPECT_EQ(board.model.blocks, falling("count").blocks);
  EXPECT_NEAR(board.model.inputs[0].poses->open, 690, 1e-9);
  EXPECT_LE(board.model.inputs[0].valid_max, 1023);
  EXPECT_EQ(folded(falling("count")).model, falling("count"));
}

TEST(Correction, AGainOfNothingIsRefused) {
  EXPECT_THROW((void)corrected(falling("count"), 0, {0, 0}), io::InputError);
  EXPECT_THROW((void)corrected(falling("count"), 0, {-1, 900}), io::InputError);
}

// A limit between two steps of Q5: both arithmetics refuse the same readings.
TEST(Correction, FixedPointRefusesWhatDoubleRefusesAtLimitsBetweenItsSteps) {
  Model m = falling("V");
  m.inputs[0].valid_min = 321.467;
  m.inputs[0].valid_max = 629.5584;
  Compensator<DoubleArithmetic> exact(m);
  Compensator<FixedArithmetic> fixed(m);
  for (int step = 32 * 321; step < 32 * 631; ++step)
    ASSERT_EQ(fixed.step(step / 32.0).status, exact.step(step / 32.0).status) << step / 32.0;
}

}  // namespace
}  // namespace flexor::model
