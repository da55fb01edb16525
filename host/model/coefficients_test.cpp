// A model in its three arithmetics, and every kind of block against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/io/io.hpp"
#include "host/io/refusal_test.hpp"
#include "host/model/compensator.hpp"
#include "host/model/random_glove.hpp"

namespace flexor::model {
namespace {

using core::Status;

// Largest distance from double over all joints.
struct Distance {
  double single_deg = 0;
  double fixed_deg = 0;
};

Distance distance(const Model& m, const std::vector<std::vector<double>>& readings) {
  Compensator<DoubleArithmetic> exact(m);
  Compensator<FloatArithmetic> single(m);
  Compensator<FixedArithmetic> fixed(m);
  Distance out;
  for (const auto& u : readings) {
    const auto y = exact.step(u);
    const auto y_single = single.step(u);
    const auto y_fixed = fixed.step(u);
    for (std::size_t j = 0; j < m.joints.size(); ++j) {
      out.single_deg = std::max(out.single_deg, std::abs(y_single[j].angle_deg - y[j].angle_deg));
      out.fixed_deg = std::max(out.fixed_deg, std::abs(y_fixed[j].angle_deg - y[j].angle_deg));
    }
  }
  return out;
}

class EveryKind : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryKind, DoubleFloatAndFixedPointAgreeOnAGlove) {
  Distance worst;
  for (unsigned seed = 0; seed < 200; ++seed) {
    RandomGlove random(seed);
    const Model m = random.make_with(GetParam());
    const Distance one = distance(m, random.readings(300));
    worst.single_deg = std::max(worst.single_deg, one.single_deg);
    worst.fixed_deg = std::max(worst.fixed_deg, one.fixed_deg);
  }
  RecordProperty("worst_float_deg", std::to_string(worst.single_deg));
  RecordProperty("worst_fixed_deg", std::to_string(worst.fixed_deg));
  EXPECT_LT(worst.single_deg, 0.001);
  EXPECT_LT(worst.fixed_deg, kFixedError_deg);
  EXPECT_GT(worst.fixed_deg, 0.02)
      << "output steps of 1/16 degree cannot be this good: is fixed point running?";
}

std::string type_name(const testing::TestParamInfo<std::size_t>& at) {
  return [&]<std::size_t... kAt>(std::index_sequence<kAt...>) {
    return std::array{kTypeOf<std::variant_alternative_t<kAt, Kind>>...}.at(at.param);
  }
  (std::make_index_sequence<std::variant_size_v<Kind>>());
}

INSTANTIATE_TEST_SUITE_P(Of, EveryKind, testing::Range<std::size_t>(0, std::variant_size_v<Kind>), type_name);

TEST(Coefficients, ThreeArithmeticsAgreeOnAnyGraph) {
  for (unsigned seed = 0; seed < 400; ++seed) {
    RandomGlove random(seed);
    const Model m = random.make();
    const Distance worst = distance(m, random.readings(200));
    ASSERT_LT(worst.single_deg, 0.001) << seed << "\n" << to_json(m);
    ASSERT_LT(worst.fixed_deg, kFixedError_deg) << seed << "\n" << to_json(m);
  }
}

Model one_joint(const std::vector<Kind>& kinds, double valid_max = 1023) {
  Model m;
  m.sample_period_s = 0.1;
  m.inputs = {{"s", "", "", "", 0, valid_max}};
  std::string signal = "s";
  for (const Kind& kind : kinds) {
    m.blocks.push_back({{signal}, fmt::format("v{}", m.blocks.size()), kind});
    signal = m.blocks.back().to;
  }
  m.joints = {{"thumb", signal, 12}};
  check(m);
  return m;
}

std::string refusal(const Model& m) {
  return io::refusal_of([&] { check_fixed(m); });
}

TEST(Coefficients, AModelThatDoesNotFitIsRefusedByName) {
  const Saturation angle{0, 90};
  // A 12-bit ADC does not fit Q5.
  EXPECT_EQ(refusal(one_joint({angle}, 4095)),
            "s: input: valid_max (4095) does not fit the fixed-point format");
  EXPECT_EQ(refusal(one_joint({Lti{30, 0, {-1}, {}}, angle})),
            "v0: lti: its signal does not fit the fixed-point format");
  EXPECT_EQ(refusal(one_joint({Hysteresis{{30}, {1}}, Gain{0.1, 0}, angle})),
            "v0: hysteresis: its signal (1053) does not fit the fixed-point format");
  // Behind a curve that holds its ends nobody asks for what is missing.
  EXPECT_EQ(refusal(one_joint({Hysteresis{{30}, {1}}, Curve{{0, 1000}, {0, 90}}, angle})), "accepted");
}

// A number beyond the signal must not cost the signal its fit: it is never reached.
TEST(Coefficients, NumbersThatASignalNeverReachesFit) {
  const Gain degrees{0.06, 0};  // to 61.4, at a fraction of 9 bits
  const Saturation angle{-30, 170};
  for (const Kind& kind : {Kind(Saturation{-20, 120}), Kind(DeadZone{-70, 80}), Kind(Play{70}),
                           Kind(Curve{{0, 60, 90}, {0, 20, 400}})}) {
    const Model m = one_joint({degrees, kind, Gain{1, 1}, angle});
    EXPECT_EQ(refusal(m), "accepted") << type_of(kind);
    EXPECT_LT(distance(m, {{0}, {1023}, {300}, {700}, {0}}).fixed_deg, kFixedError_deg) << type_of(kind);
  }
}

// Found by fuzzing: a curve that rises by 100000 degrees has steps of eight, and so had the limits.
TEST(Coefficients, AnAngleInStepsThatMissItsLimitsIsRefused) {
  const Model m = one_joint({Curve{{0, 100, 250}, {5, 0, 1e5}}, Saturation{0, 100}});
  EXPECT_NO_THROW(check(m));
  EXPECT_THROW(check_fixed(m), io::InputError);
}

TEST(Kinds, LagApproachesAStepExponentially) {
  Compensator<DoubleArithmetic> simulation(one_joint({Lag{3}, Saturation{0, 500}}));
  (void)simulation.step(20);
  for (int k = 0; k < 50; ++k)
    EXPECT_NEAR(simulation.step(100).angle_deg, 100 - 80 * std::exp(-3 * 0.1 * (k + 1)), 1e-9) << k;
}

TEST(Compensator, FixedPointRefusesNaNAndRails) {
  Model m = one_joint({Saturation{0, 1000}});
  m.inputs[0].valid_min = 1;
  m.inputs[0].valid_max = 1022;
  Compensator<FixedArithmetic> fixed(m);
  EXPECT_EQ(fixed.step(std::nan("")).status, Status::below_range);
  EXPECT_EQ(fixed.step(1023).status, Status::above_range);
  EXPECT_EQ(fixed.step(0).angle_deg, 12);
  EXPECT_EQ(fixed.step(700).angle_deg, 700);
  m.joints[0].rest_deg = 2000;  // beyond the saturation
  EXPECT_EQ(Compensator<DoubleArithmetic>(m).step(std::nan("")).angle_deg, 1000);
  EXPECT_EQ(Compensator<FixedArithmetic>(m).step(std::nan("")).angle_deg, 1000);
}

TEST(Compensator, StartsFromTheFirstSampleWithoutATransient) {
  const Model m = one_joint({Hysteresis{{30}, {0.7}}, Curve{{0, 1000}, {0, 100}}, Lti{1, 0, {-1, -0.2}, {}},
                             PolePair{2, 0.4, {0, 0}}, Saturation{0, 170}});
  Compensator<DoubleArithmetic> simulation(m);
  for (int k = 0; k < 50; ++k) EXPECT_NEAR(simulation.step(640).angle_deg, 64, 1e-12);
}

TEST(Compensator, RefusedInputsHoldTheLastGoodAngleAndLeaveTheStateAlone) {
  Compensator<DoubleArithmetic> simulation(one_joint({Lag{std::log(2.0) / 0.1}, Saturation{0, 500}}));
  const auto expect = [&](double reading, Status status, double angle_deg) {
    const auto sample = simulation.step(reading);
    EXPECT_EQ(sample.status, status) << reading;
    EXPECT_NEAR(sample.angle_deg, angle_deg, 1e-9) << reading;
  };
  expect(std::nan(""), Status::not_a_number, 12);  // rest before the first good sample
  expect(40, Status::ok, 40);
  expect(60, Status::ok, 50);
  expect(1024, Status::above_range, 50);
  expect(-std::numeric_limits<double>::infinity(), Status::below_range, 50);
  expect(70, Status::ok, 60);
  expect(70, Status::ok, 65);
}

// Two sensors; one joint needs both, the other the first alone.
Model crossed() {
  Model m;
  m.sample_period_s = 0.1;
  m.inputs = {{"a", "", "", "", 0, 1000}, {"b", "", "", "", 0, 1000}};
  m.blocks = {
      {{"a"}, "slow a", Lti{0.1, 0, {-2}, {}}},           {{"b"}, "slow b", Lti{0.1, 0, {-2}, {}}},
      {{"slow a", "slow b"}, "both", Sum{{0.5, 0.5}, 0}}, {{"both"}, "slow both", Lti{1, 0, {-3}, {}}},
      {{"slow both"}, "abduction", Saturation{0, 90}},    {{"slow a"}, "flexion", Saturation{0, 90}}};
  m.joints = {{"index_abd", "abduction", 5}, {"index", "flexion", 5}};
  return m;
}

template <class Arithmetic>
void hold_and_come_back() {
  Compensator<Arithmetic> simulation(crossed());
  Compensator<Arithmetic> untouched(crossed());  // b stands still instead of failing
  const auto step = [](auto& one, double a, double b) { return one.step(std::array{a, b}); };
  for (int k = 0; k < 3; ++k) (void)step(simulation, 100.0 * k, 800), (void)step(untouched, 100.0 * k, 800);
  const double held = step(simulation, 300, 800)[0].angle_deg;
  (void)step(untouched, 300, 800);
  for (int k = 0; k < 10; ++k) {
    const auto samples = step(simulation, 700, 2000);
    EXPECT_EQ(samples[0].status, Status::above_range);
    EXPECT_EQ(samples[0].angle_deg, held);
    EXPECT_EQ(samples[1].status, Status::ok);
    EXPECT_EQ(samples[1].angle_deg, step(untouched, 700, 800)[1].angle_deg)
        << "the good sensor's joint goes on";
  }
  // Back again: the joint goes on from the angle that it held, a lag's share of the way, and in the end arrives.
  const double target = 0.5 * 70 + 0.5 * 80;
  const auto back = step(simulation, 700, 800);
  EXPECT_EQ(back[0].status, Status::ok);
  EXPECT_GT(back[0].angle_deg, held);
  EXPECT_LT(back[0].angle_deg, held + (1 - std::exp(-0.3)) * (target - held) + 0.1);
  for (int k = 0; k < 100; ++k) (void)step(simulation, 700, 800);
  EXPECT_NEAR(step(simulation, 700, 800)[0].angle_deg, target, 0.1);
}

TEST(Compensator, AJointOfTwoSensorsHoldsWhenOneFailsAndAnotherGoesOn) {
  hold_and_come_back<DoubleArithmetic>();
  hold_and_come_back<FloatArithmetic>();
  hold_and_come_back<FixedArithmetic>();
}

TEST(Compensator, ReportsTheStatusOfTheFirstBadInput) {
  Compensator<DoubleArithmetic> simulation(crossed());
  const auto samples = simulation.step(std::array{-1.0, 2000.0});
  EXPECT_EQ(samples[0].status, Status::below_range);
  EXPECT_EQ(samples[0].angle_deg, 5);
  EXPECT_EQ(samples[1].status, Status::below_range);
}

}  // namespace
}  // namespace flexor::model
