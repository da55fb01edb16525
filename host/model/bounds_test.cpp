// What a document may hold: blocks in their order, each once, and numbers that a hand could have.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "host/io/io.hpp"
#include "host/model/compensator.hpp"
#include "host/model/random_model.hpp"

namespace flexor::model {
namespace {

using Json = nlohmann::ordered_json;

Json dead_zone() { return {{"type", "dead_zone"}, {"lower", -1}, {"upper", 1}}; }
Json hysteresis() { return {{"type", "hysteresis"}, {"radii", {3}}, {"weights", {0.5}}}; }
Json curve(double end = 90) { return {{"type", "curve"}, {"x", {0, 1000}}, {"y", {0, end}}}; }
Json lti() { return {{"type", "lti"}, {"gain", 1}, {"offset", 0}, {"poles_rad_s", {-10}}, {"taps", {0}}}; }
Json saturation() { return {{"type", "saturation"}, {"lower_deg", 0}, {"upper_deg", 90}}; }

Json document(const std::vector<Json>& blocks) {
  return {{"schema", "flexor-model"},
          {"schema_version", 1},
          {"name", "example"},
          {"sample_period_s", 0.05},
          {"channels",
           {{{"name", "index"},
             {"input", {{"column", "a"}, {"unit", "count"}, {"valid_min", 0}, {"valid_max", 1023}}},
             {"rest_deg", 10},
             {"blocks", blocks}}}}};
}

std::string refusal(const Json& json) {
  try {
    (void)from_json(json.dump(), "m.json");
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "";
}

void expect_refused(const std::vector<Json>& blocks, const std::string& place, const std::string& why) {
  const std::string what = refusal(document(blocks));
  EXPECT_NE(what.find("m.json: channels[0]: " + place), std::string::npos) << what;
  EXPECT_NE(what.find(why), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
}

TEST(ModelBlocks, ASecondCurveBeforeTheDynamicsIsRefusedInsteadOfReplacingTheFirst) {
  expect_refused({curve(), curve(50), lti(), saturation()},
                 "blocks[1]: a second \"curve\" before the \"lti\"", "blocks[0]");
}

TEST(ModelBlocks, EveryRepeatedBlockIsRefusedWithItsPlace) {
  expect_refused({dead_zone(), dead_zone(), lti(), saturation()}, "blocks[1]: a second \"dead_zone\"",
                 "blocks[0]");
  expect_refused({hysteresis(), hysteresis(), lti(), saturation()}, "blocks[1]: a second \"hysteresis\"",
                 "blocks[0]");
  expect_refused({curve(), lti(), lti(), saturation()}, "blocks[2]: a second \"lti\"", "blocks[1]");
  expect_refused({lti(), curve(), curve(), saturation()}, "blocks[2]: a second \"curve\" after the \"lti\"",
                 "blocks[1]");
  expect_refused({lti(), saturation(), saturation()}, "blocks[2]: a second \"saturation\"", "blocks[1]");
}

TEST(ModelBlocks, EveryMisplacedBlockIsRefusedWithItsPlace) {
  const std::vector<Json> order = {dead_zone(), hysteresis(), curve(), lti(), saturation()};
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      std::vector<Json> swapped = order;
      std::swap(swapped[i], swapped[j]);
      // A curve and the lti may change places: it is then the output curve.
      if (i == 2 && j == 3) {
        EXPECT_EQ(refusal(document(swapped)), "");
        continue;
      }
      const std::string what = refusal(document(swapped));
      EXPECT_NE(what.find("cannot stand here"), std::string::npos) << i << " " << j << " " << what;
      EXPECT_NE(what.find("m.json: channels[0]: blocks["), std::string::npos) << what;
    }
  }
  const std::string unknown = refusal(document({{{"type", "delay"}}, saturation()}));
  EXPECT_NE(unknown.find("blocks[0]: unknown block \"delay\""), std::string::npos) << unknown;
}

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
  Model m = from_json(document({dead_zone(), hysteresis(), curve(), lti(), saturation()}).dump(), "m.json");
  m.channels[0].lti.poles_rad_s = {-10, -3};
  m.channels[0].lti.taps = {0, 0.5};
  return m;
}

std::string check_refusal(const Model& m) {
  try {
    check(m);
  } catch (const io::InputError& error) {
    return error.what();
  }
  return "";
}

std::vector<Absurd> absurd_numbers() {
  static constexpr double huge = 1e300;
  return {
      {[&](Model& m) { m.sample_period_s = 1e-9; }, "sample_period_s"},
      {[&](Model& m) { m.sample_period_s = 1e9; }, "sample_period_s"},
      {[&](Model& m) { m.channels[0].valid_max = huge; }, "input"},
      {[&](Model& m) { m.channels[0].valid_max = 1e-300; }, "input"},
      {[&](Model& m) { m.channels[0].rest_deg = 4000; }, "rest_deg"},
      {[&](Model& m) { m.channels[0].dead_zone->upper = huge; }, "dead_zone"},
      {[&](Model& m) { m.channels[0].hysteresis->radii = {huge}; }, "hysteresis"},
      {[&](Model& m) {
         m.channels[0].input_curve->x = {0, 1e-300};
       },
       "curve"},
      {[&](Model& m) {
         m.channels[0].input_curve->x = {1000, 1000 + 1e-9};
       },
       "curve"},
      {[&](Model& m) {
         m.channels[0].input_curve->x = {0, huge};
       },
       "curve"},
      {[&](Model& m) {
         m.channels[0].input_curve->y = {0, huge};
       },
       "curve"},
      {[&](Model& m) {
         m.channels[0].input_curve->y = {0, 116000};
       },
       "curve"},
      // The curve's values are small, but not what the gain makes of them.
      {[&](Model& m) { m.channels[0].lti.gain = 100; }, "curve"},
      {[&](Model& m) { m.channels[0].lti.gain = huge; }, "gain and offset"},
      {[&](Model& m) { m.channels[0].lti.offset = -huge; }, "gain and offset"},
      {[&](Model& m) { m.channels[0].input_curve.reset(), m.channels[0].lti.gain = 1e4; }, "lti"},
      {[&](Model& m) {
         m.channels[0].lti.poles_rad_s = {-1e-300, -3};
       },
       "lti"},
      {[&](Model& m) {
         m.channels[0].lti.poles_rad_s = {-3, -1e12};
       },
       "lti"},
      {[&](Model& m) {
         m.channels[0].lti.taps = {1e200, 0};
       },
       "lti"},
      {[&](Model& m) {
         m.channels[0].output_curve = Curve{{0, 90}, {0, 116000}};
       },
       "output curve"},
      {[&](Model& m) {
         m.channels[0].output_curve = Curve{{0, 1e-300}, {0, 90}};
       },
       "output curve"},
      {[&](Model& m) {
         m.channels[0].saturation = {-huge, huge};
       },
       "saturation"},
      {[&](Model& m) {
         m.channels[0].saturation = {0, 4000};
       },
       "saturation"},
  };
}

TEST(ModelBounds, NumbersThatNoGloveHasAreRefusedByName) {
  const std::vector<Absurd> all = absurd_numbers();
  ASSERT_EQ(check_refusal(good()), "");
  for (std::size_t i = 0; i < all.size(); ++i) {
    Model m = good();
    all[i].change(m);
    const std::string what = check_refusal(m);
    EXPECT_NE(what.find(all[i].says), std::string::npos) << i << ": " << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Runs adversarial readings through every channel; false when an angle with status ok is not finite or lies
// outside the saturation.
template <class Arithmetic>
testing::AssertionResult stays_finite(const Model& m) {
  Compensator<Arithmetic> simulation(m);
  for (std::size_t i = 0; i < simulation.channels(); ++i) {
    const Channel& c = m.channels[i];
    const double span = c.valid_max - c.valid_min;
    const auto step = [&](double u) {
      const auto sample = simulation.step(i, u);
      const double y = sample.angle_deg;
      return std::isfinite(y) && y >= c.saturation.lower_deg - 0.1 && y <= c.saturation.upper_deg + 0.1;
    };
    for (int round = 0; round < 3; ++round) {
      for (const double u : {kNan, kInfinity, -kInfinity, 1e308, -1e308, c.valid_min, c.valid_max}) {
        if (!step(u)) return testing::AssertionFailure() << c.name << " reading " << u;
      }
      for (int k = 0; k <= 40; ++k) {
        if (!step(c.valid_min + span * k / 40)) return testing::AssertionFailure() << c.name << " ramp " << k;
        if (!step(k % 2 == 0 ? c.valid_max : c.valid_min))
          return testing::AssertionFailure() << c.name << " rail " << k;
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

// The runtime does not rely on the check: coefficients may come from elsewhere, or be damaged in memory.
TEST(ModelBounds, TheRuntimeHoldsTheLastAngleWhenItsArithmeticOverflows) {
  Model m = good();
  Channel& c = m.channels[0];
  c.dead_zone.reset();
  c.hysteresis.reset();
  c.input_curve.reset();
  c.lti.gain = 1e306;
  c.lti.taps = {1e200, -1e200};
  EXPECT_TRUE(stays_finite<DoubleArithmetic>(m));
  EXPECT_TRUE(stays_finite<FloatArithmetic>(m));
  Compensator<DoubleArithmetic> simulation(m);
  EXPECT_EQ(simulation.step(0, 0).status, core::Status::ok);
  const auto overflown = simulation.step(0, 1000);
  EXPECT_EQ(overflown.status, core::Status::not_a_number);
  EXPECT_EQ(overflown.angle_deg, 0);
  // The next good reading starts anew instead of carrying the infinity on.
  const auto after = simulation.step(0, 0);
  EXPECT_EQ(after.status, core::Status::ok);
  EXPECT_EQ(after.angle_deg, 0);
}

}  // namespace
}  // namespace flexor::model
