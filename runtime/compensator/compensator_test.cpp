// Every block alone, against closed forms.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <vector>

#include "runtime/compensator/blocks.hpp"
#include "runtime/compensator/graph.hpp"
#include "runtime/compensator/part_test.hpp"

namespace flexor::compensator {
namespace {

// A block with a state over a sequence, from its start.
template <class Block, class Number>
std::vector<Number> run(const Block& block, const std::vector<Number>& inputs) {
  typename Block::State state{};
  if (!inputs.empty()) block.start(state, inputs.front());
  std::vector<Number> outputs;
  for (const Number u : inputs) outputs.push_back(block.step(state, u));
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

TEST(Saturation, KeepsWhatLiesWithinAndMovesTheRestToTheNearerLimit) {
  const Saturation<int16_t> limits{29, 112};
  EXPECT_EQ(limits(28), 29);
  EXPECT_EQ(limits(70), 70);
  EXPECT_EQ(limits(INT16_MAX), 112);
}

TEST(Sum, WeighsEverySignalAndRoundsOnce) {
  const Sum<double, 3> real{3, {2, -1, 0.5}, 10};
  const double u[] = {3, 4, 8};
  EXPECT_EQ(real(u), 2 * 3 - 4 + 0.5 * 8 + 10);
  // 3/8 + 3/8 of a step: each alone would round to nothing.
  const FixedSum<2> fixed{2, 3, {3, 3}, 8};
  const int16_t one[] = {1, 1};
  EXPECT_EQ(fixed(one), 2);
  const int16_t most[] = {INT16_MAX, INT16_MAX};
  EXPECT_EQ((FixedSum<2>{2, 1, {8, 8}, 0})(most), INT16_MAX);
}

TEST(Hysteresis, PlayStaysWithinItsRadiusAndMovesOnlyAtItsEdge) {
  EXPECT_TRUE(rc::check([](const std::vector<int16_t>& inputs, uint8_t radius) {
    const Play<double> play{static_cast<double>(radius)};
    Play<double>::State state{};
    play.start(state, inputs.empty() ? 0 : inputs[0]);
    for (const auto u : inputs) {
      const double before = state.p;
      const double difference = play.step(state, u) - u;
      RC_ASSERT(std::abs(difference) <= radius);
      RC_ASSERT(state.p == before || std::abs(std::abs(difference) - radius) < 1e-9);
    }
  }));
}

TEST(Hysteresis, LoopsAreRateIndependentAndReturnToTheSameBranch) {
  const Hysteresis<double, 2> bank{{2, {5, 20}}, {0.5, 0.25}};
  const auto slow = run<Hysteresis<double, 2>, double>(
      bank, {0, 10, 20, 30, 40, 50, 60, 50, 40, 30, 20, 10, 0, 10, 20, 30});
  const auto fast = run<Hysteresis<double, 2>, double>(bank, {0, 60, 0, 30});
  EXPECT_NEAR(slow.back(), fast.back(), 1e-12);
  EXPECT_GT(slow[8], slow[4]);  // on the way down from 60 the output at 40 is above that on the way up
}

TEST(Curve, InterpolatesAndHoldsItsEnds) {
  const Curve<double, 4> curve{3, {0, 10, 30, 0}, {5, 15, -5, 0}, {1, -1, 0, 0}};
  const std::vector<double> inputs = {-100, 0, 4, 10, 20, 30, 100};
  const std::vector<double> expected = {5, 5, 9, 15, 5, -5, -5};
  for (std::size_t i = 0; i < inputs.size(); ++i) EXPECT_NEAR(curve(inputs[i]), expected[i], 1e-12) << i;
}

TEST(Lti, StepResponseIsTheExactHoldWithoutAHiddenSample) {
  const double pole = std::exp(-54 * 0.1);
  Lti<double, 1, false> lti{};
  lti.gain = 69.0 / 54.0;
  lti.input_weight[0] = 1 - pole;
  std::vector<double> inputs(10, 1.0);
  inputs.front() = 0;
  const auto y = run(lti, inputs);
  // The sample that sees the step already shows one period of response: update before output.
  for (int k = 1; k < 10; ++k) {
    EXPECT_NEAR(y[static_cast<std::size_t>(k)], 69.0 / 54.0 * (1 - std::pow(pole, k)), 1e-12) << k;
  }
}

// Q5 in, Q4 out.
FixedLti<2, false> fixed_lti() {
  FixedLti<2, false> lti{};
  lti.gain = 16384;
  lti.gain_shift = -1;  // Q5 * 2^14 * 2^1 = Q20
  lti.input_weight[0] = {40000, 3};
  lti.input_weight[1] = {60000, 6};
  lti.chain_weight[chain_index(1, 0)] = {50000, 2};
  lti.output_shift = 16;
  return lti;
}

TEST(Lti, StatesNeverLeaveTheRangeOfTheInputsInAnyArithmetic) {
  EXPECT_TRUE(rc::check([](const std::vector<uint16_t>& raw) {
    std::vector<int16_t> inputs;
    for (const auto u : raw) inputs.push_back(static_cast<int16_t>(std::min(u & 0x7fff, 32766)));
    int16_t low = 32767;
    int16_t high = 0;
    const auto y = run(fixed_lti(), inputs);
    for (std::size_t k = 0; k < y.size(); ++k) {
      low = std::min(low, inputs[k]);
      high = std::max(high, inputs[k]);
      RC_ASSERT(y[k] >= low / 2 - 1 && y[k] <= high / 2 + 1);
    }
  }));
}

// e[k] = exp(A k T) e[0] of x' = omega v, v' = omega (u - x - 2 zeta v), written with cosine and sine.
struct Damped {
  double omega;
  double zeta;

  double damped() const { return omega * std::sqrt(1 - zeta * zeta); }
  PolePair<double> block(double period, double c0, double c1) const {
    const double decay = std::exp(-zeta * omega * period);
    const double c = decay * std::cos(damped() * period);
    const double s = decay * std::sin(damped() * period) * omega / damped();
    return {{c + zeta * s, s, -s, c - zeta * s}, {c0, c1}};
  }
  // After a step from 0 to 1: position and speed (in units of omega).
  double x(double t) const {
    return 1 - std::exp(-zeta * omega * t) *
                   (std::cos(damped() * t) + zeta * omega / damped() * std::sin(damped() * t));
  }
  double v(double t) const { return std::exp(-zeta * omega * t) * omega / damped() * std::sin(damped() * t); }
};

TEST(PolePair, StepResponseIsTheDampedOscillation) {
  const double period = 0.02;
  for (const Damped pair : {Damped{12, 0.2}, Damped{30, 0.7}, Damped{5, 0.98}}) {
    std::vector<double> inputs(200, 1.0);
    inputs.front() = 0;
    const auto y = run(pair.block(period, 0.3, -0.8), inputs);
    EXPECT_EQ(y[0], 0);
    for (int k = 1; k < 200; ++k) {
      const double x = pair.x(k * period);
      const double expected = x + 0.3 * (1 - x) - 0.8 * pair.v(k * period);
      EXPECT_NEAR(y[static_cast<std::size_t>(k)], expected, 1e-12) << pair.omega << " " << k;
    }
  }
}

// The number of the last operation has the value of an end: who runs it goes on beyond the part.
TEST(Graph, ASectionWithoutAnEndIsRefused) {
  constexpr uint8_t kPlay = static_cast<uint8_t>(Operation::play);
  constexpr uint8_t kEnd = static_cast<uint8_t>(Operation::end);
  const auto load = [](const std::vector<uint8_t>& code) {
    const std::vector<uint8_t> part = part_of(0, 2, code);
    Graph<core::Ram, 800> graph;
    graph.clear();
    const uint16_t calibration[kSensors] = {};
    return graph.add(part.data(), static_cast<uint16_t>(part.size()), {calibration, 50});
  };
  EXPECT_EQ(load({kPlay, 0, 0, kEnd, kEnd}), Loaded::ok);
  EXPECT_EQ(load({kPlay, 0, 0, kEnd}), Loaded::malformed);
  EXPECT_EQ(load({kPlay, 0, 0, 3}), Loaded::malformed);
  EXPECT_EQ(load({kEnd, kEnd}), Loaded::malformed);
  EXPECT_EQ(load({}), Loaded::malformed);
}

template <class Block>
bool rests(const Block& block, int16_t u, int16_t expected) {
  return run(block, std::vector<int16_t>(50, u)) == std::vector<int16_t>(50, expected);
}

// In integers too: nothing creeps because a product was rounded.
TEST(Blocks, AMotionlessInputGivesAMotionlessOutput) {
  const FixedHysteresis<2> hysteresis{{2, {30, 300}}, {2867, -1234}};
  const FixedPolePair pair{{-768, 3000, -3000, -1768}, 15, {28000, -9000}, 14, 8, 9};
  EXPECT_TRUE(rc::check([&](int16_t any) {
    RC_ASSERT(rests(Play<int16_t>{40}, any, any));
    RC_ASSERT(rests(hysteresis, any, any));
    RC_ASSERT(rests(FixedLag{{40000, 3}}, any, any));
    RC_ASSERT(rests(pair, any, static_cast<int16_t>((any + 1) >> 1)));
    RC_ASSERT(rests(fixed_lti(), any, static_cast<int16_t>((any + 1) >> 1)));
  }));
}

}  // namespace
}  // namespace flexor::compensator
