// What a document may hold: numbers that a hand could have.
#include <gtest/gtest.h>

#include "host/io/refusal_test.hpp"
#include "host/model/channel.hpp"
#include "host/model/random_model.hpp"
#include "host/model/unsafe_reading_test.hpp"

namespace flexor::model {
namespace {

TEST(ModelBlocks, AnyValidModelRoundTripsExactly) {
  for (unsigned seed = 0; seed < 2000; ++seed) {
    const Model m = RandomModel(seed).make();
    ASSERT_EQ(from_json(to_json(m), "m.json"), m) << seed << "\n" << to_json(m);
  }
}

Model good() {
  Channel c;
  c.name = "index";
  c.input_column = "a";
  c.input_unit = "count";
  c.rest_deg = 10;
  c.dead_zone = DeadZone{-1, 1};
  c.hysteresis = Hysteresis{{3}, {0.5}};
  c.input_curve = c.output_curve = Curve{{0, 1000}, {0, 90}};
  c.lti = {1, 0, {-10, -3}, {0, 0.5}};
  c.saturation = {0, 90};
  return model_of(c, 0.05);
}

std::string check_refusal(const Model& m) {
  return io::refusal_of([&] { check(m); });
}

constexpr double kHuge = 1e300;

// One number of a good document changed; what the refusal must name.
struct Absurd {
  const char* place;
  Json value;
  const char* reason;
};

std::vector<Absurd> absurd_numbers() {
  return {{"/sample_period_s", 1e-9, "sample_period_s"},
          {"/sample_period_s", 1.01 * kMaxPeriod_s, "sample_period_s"},
          {"/max_gap_s", -1, "max_gap_s"},
          {"/inputs/0/valid_max", kHuge, "a: input"},
          {"/inputs/0/valid_max", 1e-300, "a: input"},
          {"/inputs/0/valid_max", 0, "a: input"},
          {"/inputs/0/strip", "toe", "a: input"},
          {"/inputs/0/readings", {{"share", {0.5, 0.1}}, {"reading", {1, 2}}}, "a: input: readings"},
          {"/inputs/0/readings", {{"share", {0.1, 0.5}}, {"reading", {2, 2}}}, "a: input: readings"},
          {"/joints/0/name", "index mcp", "m.json: a joint"},
          {"/joints/0/rest_deg", 4000, "index: joint: rest_deg"},
          {"/blocks/0/upper", kHuge, "index dead zone: dead_zone"},
          {"/blocks/1/radii", {kHuge}, "index hysteresis: hysteresis"},
          {"/blocks/1/radii", {1, 1, 1, 1, 1}, "index hysteresis: hysteresis"},
          {"/blocks/2/x", {0, 1e-300}, "index curve: curve"},
          {"/blocks/2/x", {1000, 1000 + 1e-9}, "index curve: curve"},
          {"/blocks/2/x", {0, kHuge}, "index curve: curve"},
          {"/blocks/2/y", {0, kHuge}, "index curve: curve"},
          {"/blocks/3/gain", kHuge, "index dynamics: lti: gain"},  // whatever is left of the input
          {"/blocks/3/gain", 1e8, "index dynamics: lti"},
          {"/blocks/3/offset", -kHuge, "index dynamics: lti"},
          {"/blocks/3/poles_rad_s", {-1e-300, -3}, "index dynamics: lti"},
          {"/blocks/3/poles_rad_s", {-3, -1e12}, "index dynamics: lti"},
          {"/blocks/3/poles_rad_s", {-3, -3, -3, -3}, "index dynamics: lti"},
          {"/blocks/3/taps", {1e200, 0}, "index dynamics: lti"},
          {"/blocks/4/y", {0, 1.2e6}, "index angle: saturation"},  // the last curve's values, which it takes
          {"/blocks/5/upper_deg", kHuge, "index angle: saturation"},
          {"/blocks/5/upper_deg", 4000, "index angle: saturation"},
          {"/blocks/5/lower_deg", 90, "index angle: saturation"}};
}

// In place of the hysteresis, which takes counts.
std::vector<std::pair<Kind, const char*>> absurd_kinds() {
  return {{Play{-1}, "play: the radius"},
          {Play{kHuge}, "play"},
          {Lag{0}, "lag: rate_rad_s"},
          {Lag{1e12}, "lag: rate_rad_s"},
          {PolePair{1e12, 0.5, {0, 0}}, "pole_pair: frequency_rad_s"},
          {PolePair{1e-4, 0.5, {0, 0}}, "pole_pair: so slow"},
          {PolePair{10, 0, {0, 0}}, "pole_pair: the damping"},
          {PolePair{10, 1, {0, 0}}, "pole_pair: the damping"},
          {PolePair{10, 0.5, {0, kHuge}}, "pole_pair: there must be two taps"},
          {PolePair{10, 0.5, {0}}, "pole_pair: there must be two taps"},
          {Gain{kHuge, 0}, "gain"},
          {Sum{{1}, kHuge}, "sum"},
          {Sum{{1e8}, 0}, "sum: takes valid readings"}};
}

TEST(ModelBounds, NumbersThatNoGloveHasAreRefusedByName) {
  ASSERT_EQ(check_refusal(good()), "accepted");
  const auto expect = [](const std::string& refusal, const std::string& reason) {
    EXPECT_NE(refusal.find(reason), std::string::npos) << reason << ": " << refusal;
    EXPECT_EQ(refusal.find('\n'), std::string::npos) << refusal;
  };
  for (const Absurd& one : absurd_numbers()) {
    Json document = Json::parse(to_json(good()));
    document[Json::json_pointer(one.place)] = one.value;
    expect(io::refusal_of([&] { (void)from_json(document.dump(), "m.json"); }), one.reason);
  }
  for (const auto& [kind, reason] : absurd_kinds()) {
    Model m = good();
    m.blocks[1].kind = kind;
    expect(check_refusal(m), reason);
  }
  Model m = good();
  m.blocks.resize(501, m.blocks[0]);
  expect(check_refusal(m), "501 blocks");
  m.joints.resize(501, m.joints[0]);
  m.inputs.resize(501, m.inputs[0]);
  expect(check_refusal(m), "501 inputs");
  m.inputs.resize(1);
  m.blocks.resize(1);
  expect(check_refusal(m), "501 joints");
}

TEST(ModelBounds, EveryModelWithinThemStaysFiniteInDoubleAndFloat) {
  for (unsigned seed = 0; seed < 3000; ++seed) {
    const Model m = RandomModel(seed).make();
    ASSERT_EQ(unsafe_reading<DoubleArithmetic>(m), std::nullopt) << seed << "\n" << to_json(m);
    ASSERT_EQ(unsafe_reading<FloatArithmetic>(m), std::nullopt) << seed << "\n" << to_json(m);
  }
}

// The runtime does not rely on the check: a model may come from elsewhere, or be damaged in memory.
TEST(ModelBounds, TheRuntimeHoldsTheLastAngleWhenItsArithmeticOverflows) {
  Model m;
  m.sample_period_s = 0.1;
  m.inputs.push_back({"a", "", "", "", 0, 1023});
  std::string signal = "a";
  const auto next = [&](const Kind& kind) {
    m.blocks.push_back({{signal}, fmt::format("signal {}", m.blocks.size()), kind});
    signal = m.blocks.back().to;
  };
  for (int i = 0; i < 40; ++i) next(Gain{1e9, 0});
  next(Lti{1, 0, {-10, -3}, {}});
  next(Saturation{0, 90});
  m.joints.push_back({"index", signal, 0});
  EXPECT_NE(check_refusal(m), "accepted");
  Compensator<DoubleArithmetic> simulation(m);
  EXPECT_EQ(simulation.step(0).status, core::Status::ok);
  const auto overflown = simulation.step(1000);
  EXPECT_EQ(overflown.status, core::Status::not_a_number);
  EXPECT_EQ(overflown.angle_deg, 0);
  // The next good reading starts again instead of carrying the infinity on.
  const auto after = simulation.step(0);
  EXPECT_EQ(after.status, core::Status::ok);
  EXPECT_EQ(after.angle_deg, 0);
}

}  // namespace
}  // namespace flexor::model
