// What a document may hold: numbers that a hand could have.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "host/io/refusal_test.hpp"
#include "host/model/channel.hpp"
#include "host/model/compensator.hpp"
#include "host/model/random_model.hpp"

namespace flexor::model {
namespace {

TEST(ModelBlocks, AnyValidModelRoundTripsExactly) {
  for (unsigned seed = 0; seed < 2000; ++seed) {
    const Model m = RandomModel(seed).make();
    ASSERT_EQ(from_json(to_json(m), "m.json"), m) << seed << "\n" << to_json(m);
  }
}

// One number of a good model changed; what the refusal must say.
struct Absurd {
  std::function<void(Model&)> change;
  const char* says;
};

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

// The first block of its kind.
template <class K>
K& of(Model& m) {
  const auto it =
      std::ranges::find_if(m.blocks, [](const Block& b) { return std::holds_alternative<K>(b.kind); });
  return std::get<K>(it->kind);
}

std::string check_refusal(const Model& m) {
  return io::refusal_of([&] { check(m); });
}

constexpr double kHuge = 1e300;

// In place of the hysteresis, which takes counts.
template <class K>
Absurd instead(K kind, const char* says) {
  return {[kind](Model& m) { m.blocks[1].kind = kind; }, says};
}

std::vector<Absurd> absurd_documents() {
  return {
      {[](Model& m) { m.sample_period_s = 1e-9; }, "sample_period_s"},
      {[](Model& m) { m.sample_period_s = 1e9; }, "sample_period_s"},
      {[](Model& m) { m.max_gap_s = -1; }, "max_gap_s"},
      {[](Model& m) { m.inputs[0].valid_max = kHuge; }, "a: input"},
      {[](Model& m) { m.inputs[0].valid_max = 1e-300; }, "a: input"},
      {[](Model& m) { m.inputs[0].valid_max = 0; }, "a: input"},
      {[](Model& m) { m.inputs[0].strip = "toe"; }, "a: input"},
      {[](Model& m) { m.joints[0].rest_deg = 4000; }, "index: joint: rest_deg"},
      {[](Model& m) {
         of<Saturation>(m) = {-kHuge, kHuge};
       },
       "index angle: saturation"},
      {[](Model& m) {
         of<Saturation>(m) = {0, 4000};
       },
       "index angle: saturation"},
      {[](Model& m) {
         of<Saturation>(m) = {50, 50};
       },
       "index angle: saturation"},
      {[](Model& m) { m.inputs.resize(501, m.inputs[0]); }, "501 inputs"},
      {[](Model& m) { m.joints.resize(501, m.joints[0]); }, "501 joints"},
      {[](Model& m) { m.blocks.resize(501, m.blocks[0]); }, "501 blocks"},
  };
}

std::vector<Absurd> absurd_chain_numbers() {
  return {
      {[](Model& m) { of<DeadZone>(m).upper = kHuge; }, "index dead zone: dead_zone"},
      {[](Model& m) { of<Hysteresis>(m).radii = {kHuge}; }, "index hysteresis: hysteresis"},
      {[](Model& m) { of<Hysteresis>(m).radii.assign(5, 1); }, "index hysteresis: hysteresis"},
      {[](Model& m) {
         of<Curve>(m).x = {0, 1e-300};
       },
       "index curve: curve"},
      {[](Model& m) {
         of<Curve>(m).x = {1000, 1000 + 1e-9};
       },
       "index curve: curve"},
      {[](Model& m) {
         of<Curve>(m).x = {0, kHuge};
       },
       "index curve: curve"},
      {[](Model& m) {
         of<Curve>(m).y = {0, kHuge};
       },
       "index curve: curve"},
      // The last curve's values are what the saturation takes.
      {[](Model& m) {
         std::get<Curve>(m.blocks[4].kind).y = {0, 1.2e6};
       },
       "index angle: saturation"},
      {[](Model& m) { of<Lti>(m).gain = kHuge; }, "index dynamics: lti"},
      {[](Model& m) { of<Lti>(m).offset = -kHuge; }, "index dynamics: lti"},
      {[](Model& m) { of<Lti>(m).gain = 1e8; }, "index dynamics: lti"},
      // Nothing of the input is left, so that the product is zero; but not in float.
      {[](Model& m) {
         of<Curve>(m).y = {0, 0}, of<Lti>(m).gain = kHuge;
       },
       "index dynamics: lti"},
      {[](Model& m) {
         of<Lti>(m).poles_rad_s = {-1e-300, -3};
       },
       "index dynamics: lti"},
      {[](Model& m) {
         of<Lti>(m).poles_rad_s = {-3, -1e12};
       },
       "index dynamics: lti"},
      {[](Model& m) { of<Lti>(m).poles_rad_s.assign(4, -3); }, "index dynamics: lti"},
      {[](Model& m) {
         of<Lti>(m).taps = {1e200, 0};
       },
       "index dynamics: lti"},
  };
}

std::vector<Absurd> absurd_kinds() {
  return {
      instead(Play{-1}, "play: the radius"),
      instead(Play{kHuge}, "play"),
      instead(Lag{0}, "lag: rate_rad_s"),
      instead(Lag{1e12}, "lag: rate_rad_s"),
      instead(PolePair{1e12, 0.5, {0, 0}}, "pole_pair: frequency_rad_s"),
      instead(PolePair{1e-4, 0.5, {0, 0}}, "pole_pair: so slow"),
      instead(PolePair{10, 0, {0, 0}}, "pole_pair: the damping"),
      instead(PolePair{10, 1, {0, 0}}, "pole_pair: the damping"),
      instead(PolePair{10, 0.5, {0, kHuge}}, "pole_pair: there must be two taps"),
      instead(PolePair{10, 0.5, {0}}, "pole_pair: there must be two taps"),
      instead(Gain{kHuge, 0}, "gain"),
      instead(Sum{{1}, kHuge}, "sum"),
      instead(Sum{{1e8}, 0}, "sum: takes valid readings"),
  };
}

TEST(ModelBounds, NumbersThatNoGloveHasAreRefusedByName) {
  ASSERT_EQ(check_refusal(good()), "accepted");
  for (const auto& all : {absurd_documents(), absurd_chain_numbers(), absurd_kinds()}) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      Model m = good();
      all[i].change(m);
      const std::string what = check_refusal(m);
      EXPECT_NE(what.find(all[i].says), std::string::npos) << i << " " << all[i].says << ": " << what;
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    }
  }
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Runs adversarial readings through every input, the others at rest or following; false when an angle lies
// outside its limits, and when readings that are all valid are not answered.
template <class Arithmetic>
testing::AssertionResult stays_finite(const Model& m) {
  Compensator<Arithmetic> simulation(m);
  std::vector<double> u;
  for (const Input& input : m.inputs) u.push_back(input.valid_min);
  const auto step = [&](bool valid) {
    const auto samples = simulation.step(u);
    for (std::size_t j = 0; j < m.joints.size(); ++j) {
      const Saturation& limit = limits(m, m.joints[j]);
      const double y = samples[j].angle_deg;
      if (!(y >= limit.lower_deg - 0.1 && y <= limit.upper_deg + 0.1)) return false;
      if (valid && samples[j].status != core::Status::ok) return false;
    }
    return true;
  };
  for (std::size_t i = 0; i < m.inputs.size(); ++i) {
    const double low = m.inputs[i].valid_min;
    const double high = m.inputs[i].valid_max;
    const auto give = [&](double reading) {
      u[i] = reading;
      return step(reading >= low && reading <= high);
    };
    for (int round = 0; round < 3; ++round) {
      for (const double reading : {kNan, kInfinity, -kInfinity, 1e308, -1e308, low, high}) {
        if (!give(reading)) return testing::AssertionFailure() << m.inputs[i].name << " reading " << reading;
      }
      for (int k = 0; k <= 40; ++k) {
        if (!give(low + (high - low) * k / 40)) return testing::AssertionFailure() << "ramp " << k;
        if (!give(k % 2 == 0 ? high : low)) return testing::AssertionFailure() << "rail " << k;
      }
    }
  }
  return testing::AssertionSuccess();
}

TEST(ModelBounds, EveryModelWithinThemStaysFiniteInDoubleAndFloat) {
  for (unsigned seed = 0; seed < 3000; ++seed) {
    const Model m = RandomModel(seed).make();
    ASSERT_TRUE(stays_finite<DoubleArithmetic>(m)) << seed << "\n" << to_json(m);
    ASSERT_TRUE(stays_finite<FloatArithmetic>(m)) << seed << "\n" << to_json(m);
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
  // The next good reading starts anew instead of carrying the infinity on.
  const auto after = simulation.step(0);
  EXPECT_EQ(after.status, core::Status::ok);
  EXPECT_EQ(after.angle_deg, 0);
}

}  // namespace
}  // namespace flexor::model
