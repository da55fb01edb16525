#include "runtime/compensator/compensator.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <limits>
#include <vector>

namespace flexor::compensator {
namespace {

using core::Status;
using Full = Shape<2, 4, 2, 3>;
using Double = Floating<double, Full>;
using DoubleChannel = Channel<Double, Full>;

// Identity blocks around an order-2 LTI; tests change what they look at.
DoubleChannel::Coefficients identity() {
  DoubleChannel::Coefficients c{};
  c.valid_min = -1000;
  c.valid_max = 1000;
  c.lti.gain = 1;
  c.lti.tap[0] = 1;  // y = w
  c.lower = -500;
  c.upper = 500;
  c.rest = 0;
  return c;
}

std::vector<double> run(const DoubleChannel::Coefficients& c, const std::vector<double>& inputs) {
  DoubleChannel::State state;
  std::uint8_t started = 0;
  double y = DoubleChannel::rest(c);
  std::vector<double> outputs;
  for (const double u : inputs) {
    EXPECT_EQ(DoubleChannel::step(c, state, started, 1, u, y), Status::ok);
    outputs.push_back(y);
  }
  return outputs;
}

TEST(DeadZone, HasSeparateEdgesAndUnitSlopeOutside) {
  const DeadZone<double> phi{-10, 20};
  EXPECT_EQ(phi(-15), -5);
  EXPECT_EQ(phi(-10), 0);
  EXPECT_EQ(phi(5), 0);
  EXPECT_EQ(phi(20), 0);
  EXPECT_EQ(phi(50), 30);
}

TEST(Hysteresis, PlayStaysWithinItsRadiusAndMovesOnlyAtItsEdge) {
  EXPECT_TRUE(rc::check([](const std::vector<int16_t>& inputs, uint8_t radius) {
    Plays<double, 1> plays{1, {static_cast<double>(radius)}};
    Plays<double, 1>::State state{};
    plays.start(state, inputs.empty() ? 0 : inputs[0]);
    for (const auto u : inputs) {
      const double before = state.p[0];
      const double difference = plays.step(state, 0, u);
      RC_ASSERT(std::abs(difference) <= radius);
      RC_ASSERT(state.p[0] == before || std::abs(std::abs(difference) - radius) < 1e-9);
    }
  }));
}

TEST(Hysteresis, LoopsAreRateIndependentAndReturnToTheSameBranch) {
  auto c = identity();
  c.hysteresis.plays = {2, {5, 20}};
  c.hysteresis.weight[0] = 0.5;
  c.hysteresis.weight[1] = 0.25;
  const auto slow = run(c, {0, 10, 20, 30, 40, 50, 60, 50, 40, 30, 20, 10, 0, 10, 20, 30});
  const auto fast = run(c, {0, 60, 0, 30});
  EXPECT_NEAR(slow.back(), fast.back(), 1e-12);
  EXPECT_GT(slow[8], slow[4]);  // on the way down from 60 the output at 40 is above that on the way up
}

TEST(Curve, InterpolatesAndHoldsItsEnds) {
  auto c = identity();
  c.input_curve = {3, {0, 10, 30, 0}, {5, 15, -5, 0}, {1, -1, 0, 0}};
  const auto y = run(c, {-100, 0, 4, 10, 20, 30, 100});
  const std::vector<double> expected = {5, 5, 9, 15, 5, -5, -5};
  for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], expected[i], 1e-12) << i;
}

TEST(Curve, OutputCurveStandsBehindTheDynamics) {
  auto c = identity();
  c.lti.gain = 2;
  c.output_curve = {2, {0, 100, 0}, {50, 0, 0}, {-0.5, 0, 0}};
  EXPECT_NEAR(run(c, {10})[0], 40, 1e-12);
}

TEST(Lti, StepResponseIsTheExactHoldWithoutAHiddenSample) {
  using First = Shape<0, 0, 1, 0>;
  using FirstChannel = Channel<Floating<double, First>, First>;
  const double pole = std::exp(-54 * 0.1);
  FirstChannel::Coefficients c{};
  c.valid_min = -1;
  c.valid_max = 2000;
  c.lti.gain = 69.0 / 54.0;
  c.lti.input_weight[0] = 1 - pole;
  c.lower = -1e9;
  c.upper = 1e9;
  FirstChannel::State state;
  std::uint8_t started = 0;
  double y = FirstChannel::rest(c);
  FirstChannel::step(c, state, started, 1, 0, y);
  for (int k = 1; k < 10; ++k) {
    FirstChannel::step(c, state, started, 1, 1, y);
    // The sample that sees the step already shows one period of response: update before output.
    EXPECT_NEAR(y, 69.0 / 54.0 * (1 - std::pow(pole, k)), 1e-12) << k;
  }
}

TEST(Lti, StatesNeverLeaveTheRangeOfTheInputsInAnyArithmetic) {
  EXPECT_TRUE(rc::check([](const std::vector<uint16_t>& inputs) {
    using Second = Shape<0, 0, 2, 0>;
    using FixedChannel = Channel<Fixed<Second>, Second>;
    FixedChannel::Coefficients c{};
    c.valid_max = 32766;
    c.lti.gain = 16384;
    c.lti.gain_shift = -1;  // Q5 * 2^14 * 2^1 = Q20
    c.lti.input_weight[0] = {40000, 3};
    c.lti.input_weight[1] = {60000, 6};
    c.lti.chain_weight[chain_index(1, 0)] = {50000, 2};
    c.lower = -32768;
    c.upper = 32767;
    c.lti.tap_fraction = 14;
    FixedChannel::State state;
    std::uint8_t started = 0;
    int16_t y = FixedChannel::rest(c);
    int16_t low = 32767;
    int16_t high = 0;
    for (const auto raw : inputs) {
      const auto u = static_cast<int16_t>(std::min(raw & 0x7fff, 32766));
      low = std::min(low, u);
      high = std::max(high, u);
      FixedChannel::step(c, state, started, 1, u, y);
      RC_ASSERT(y >= low / 2 - 1 && y <= high / 2 + 1);  // Q4 out of Q5
    }
  }));
}

TEST(Channel, StartsFromTheFirstSampleWithoutATransient) {
  auto c = identity();
  c.hysteresis.plays = {1, {30, 0}};
  c.hysteresis.weight[0] = 0.7;
  c.input_curve = {2, {0, 1000}, {0, 100}, {0.1, 0}};
  c.lti.tap[0] = 0;
  c.lti.input_weight[0] = 0.1;
  c.lti.input_weight[1] = 0.01;
  c.lti.chain_weight[0] = 0.05;
  for (const double y : run(c, std::vector<double>(50, 640))) EXPECT_NEAR(y, 64, 1e-12);
}

TEST(Channel, RefusedInputsHoldTheLastGoodAngleAndLeaveTheStateAlone) {
  auto c = identity();
  c.rest = 7;
  DoubleChannel::State state;
  std::uint8_t started = 0;
  double y = DoubleChannel::rest(c);
  EXPECT_EQ(DoubleChannel::step(c, state, started, 1, std::numeric_limits<double>::quiet_NaN(), y),
            Status::not_a_number);
  EXPECT_EQ(y, 7);  // rest before the first good sample
  EXPECT_EQ(DoubleChannel::step(c, state, started, 1, 40, y), Status::ok);
  EXPECT_EQ(DoubleChannel::step(c, state, started, 1, 1001, y), Status::above_range);
  EXPECT_EQ(y, 40);
  EXPECT_EQ(DoubleChannel::step(c, state, started, 1, -std::numeric_limits<double>::infinity(), y),
            Status::below_range);
  EXPECT_EQ(y, 40);
  EXPECT_EQ(DoubleChannel::step(c, state, started, 1, 41, y), Status::ok);
  EXPECT_EQ(y, 41);
}

TEST(Channel, OutputNeverLeavesTheSaturationWhateverTheInput) {
  auto c = identity();
  c.rest = 1000;
  c.lower = 29;
  c.upper = 112;
  EXPECT_TRUE(rc::check([&](const std::vector<double>& inputs) {
    DoubleChannel::State state;
    std::uint8_t started = 0;
    double y = DoubleChannel::rest(c);
    for (const double u : inputs) {
      DoubleChannel::step(c, state, started, 1, u, y);
      RC_ASSERT(y >= 29 && y <= 112);
    }
  }));
}

TEST(Compensator, ChannelsDoNotTouchEachOther) {
  DoubleChannel::Coefficients both[2] = {identity(), identity()};
  both[1].lti.gain = 2;
  Compensator<Double, Full, 2> glove(both);
  const double in[2] = {30, 5000};
  double out[2];
  Status status[2];
  glove.step(in, out, status);
  EXPECT_EQ(out[0], 30);
  EXPECT_EQ(status[0], Status::ok);
  EXPECT_EQ(out[1], 0);
  EXPECT_EQ(status[1], Status::above_range);
}

}  // namespace
}  // namespace flexor::compensator
