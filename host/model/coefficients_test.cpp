#include "host/model/coefficients.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "host/io/io.hpp"
#include "host/model/compensator.hpp"

namespace flexor::model {
namespace {

// A smooth random walk inside [0, 1023], as a sensor would give.
std::vector<double> random_input(std::size_t n, std::uint32_t seed) {
  std::vector<double> u(n);
  double value = 500;
  for (double& sample : u) {
    seed = seed * 1664525u + 1013904223u;
    value = std::clamp(value + (static_cast<double>(seed >> 8) / 16777216.0 - 0.5) * 120, 0.0, 1023.0);
    sample = value;
  }
  return u;
}

Model random_model() {
  const auto uniform = [](double low, double high) {
    return low + (high - low) * *rc::gen::inRange(0, 1000001) / 1e6;
  };
  Model m;
  m.sample_period_s = uniform(0.01, 0.1);
  Channel c;
  c.name = "ring";
  c.valid_min = 0;
  c.valid_max = 1023;
  if (*rc::gen::arbitrary<bool>()) {
    c.dead_zone = DeadZone{uniform(0, 300), uniform(300, 400)};
    // The curve below expects the range of a plain sensor: shift it with the dead zone.
  }
  if (*rc::gen::arbitrary<bool>()) c.hysteresis = Hysteresis{{uniform(1, 40)}, {uniform(-0.5, 0.5)}};
  Curve curve;
  double x = c.dead_zone ? -400 : 0;
  double y = uniform(0, 20);
  for (int i = 0; i < 6; ++i) {
    curve.x.push_back(x);
    curve.y.push_back(y);
    x += uniform(100, 200);
    y += uniform(0, 25);
  }
  c.input_curve = curve;
  const int order = *rc::gen::inRange(0, 4);
  for (int i = 0; i < order; ++i) c.lti.poles_rad_s.push_back(-uniform(0.2, 60));
  c.saturation = Saturation{-10, 170};
  m.channels = {c};
  return m;
}

TEST(Coefficients, FloatAndFixedFollowDoubleForAnyModel) {
  EXPECT_TRUE(rc::check([] {
    const Model m = random_model();
    Compensator<DoubleArithmetic> exact(m);
    Compensator<FloatArithmetic> single(m);
    Compensator<FixedArithmetic> fixed(m);
    double worst_single = 0;
    double worst_fixed = 0;
    for (const double u : random_input(400, 7)) {
      const double y = exact.step(0, u).angle_deg;
      worst_single = std::max(worst_single, std::abs(single.step(0, u).angle_deg - y));
      worst_fixed = std::max(worst_fixed, std::abs(fixed.step(0, u).angle_deg - y));
    }
    RC_LOG() << to_json(m) << "float " << worst_single << " fixed " << worst_fixed << "\n";
    RC_ASSERT(worst_single < 0.001);
    RC_ASSERT(worst_fixed < 0.06);
  }));
}

TEST(Coefficients, AnExactShapeGivesTheBitsOfTheGeneralOne) {
  using Small = compensator::Shape<0, 6, 2, 0, false>;
  using SmallChannel = compensator::Channel<compensator::Fixed<Small>, Small>;
  EXPECT_TRUE(rc::check([] {
    Model m = random_model();
    m.channels[0].hysteresis.reset();
    m.channels[0].lti.poles_rad_s = {-3, -20};
    Compensator<FixedArithmetic> general(m);
    const auto c = fixed_coefficients<Small>(m.channels[0], m.sample_period_s);
    SmallChannel::State state;
    std::uint8_t started = 0;
    std::int16_t y = SmallChannel::rest(c);
    for (const double u : random_input(200, 3)) {
      SmallChannel::step(c, state, started, 1, static_cast<std::int16_t>(std::lround(u * 32)), y);
      RC_ASSERT(y / 16.0 == general.step(0, u).angle_deg);
    }
  }));
}

TEST(Coefficients, AModelThatDoesNotFitIsRefusedByName) {
  Model m;
  m.sample_period_s = 0.1;
  Channel c;
  c.name = "thumb";
  c.valid_max = 4095;  // a 12-bit ADC does not fit Q5
  c.saturation = {0, 90};
  m.channels = {c};
  try {
    Compensator<FixedArithmetic> fixed(m);
    FAIL();
  } catch (const io::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("channel thumb: valid_max (4095)"), std::string::npos)
        << error.what();
  }
}

TEST(Coefficients, AShapeThatIsTooSmallIsRefusedByName) {
  Channel c;
  c.name = "thumb";
  c.saturation = {0, 90};
  c.lti.poles_rad_s = {-1, -2};
  EXPECT_THROW((floating_coefficients<float, compensator::HammersteinWienerShape>(c, 0.1)), io::InputError);
  c.lti.poles_rad_s = {-1};
  EXPECT_NO_THROW((floating_coefficients<float, compensator::HammersteinWienerShape>(c, 0.1)));
  c.lti.taps = {0.5};
  EXPECT_THROW((floating_coefficients<float, compensator::HammersteinWienerShape>(c, 0.1)), io::InputError);
}

TEST(Compensator, FixedPointRefusesNaNAndRails) {
  Model m;
  m.sample_period_s = 0.1;
  Channel c;
  c.name = "thumb";
  c.valid_min = 1;
  c.valid_max = 1022;
  c.rest_deg = 12;
  c.saturation = {0, 2000};
  m.channels = {c};
  Compensator<FixedArithmetic> fixed(m);
  EXPECT_EQ(fixed.step(0, std::nan("")).status, core::Status::below_range);
  EXPECT_EQ(fixed.step(0, 1023).status, core::Status::above_range);
  EXPECT_EQ(fixed.step(0, 0).angle_deg, 12);
  EXPECT_EQ(fixed.step(0, 700).angle_deg, 700);
}

}  // namespace
}  // namespace flexor::model
