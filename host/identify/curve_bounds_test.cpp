// A curve that was fitted never says angles that the finger cannot have had.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/identify/fit.hpp"
#include "host/identify/structure_text.hpp"

namespace flexor::identify {
namespace {

// A smooth motion; the sensor reads 200 to 800, the angle goes from about 10 to 80.
Data example(int samples, double noise_deg, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_deg);
  Data data;
  data.channel = "ring";
  data.period_s = 0.05;
  data.input.resize(samples);
  data.angle_deg.resize(samples);
  data.use.assign(static_cast<std::size_t>(samples), 1);
  double x = 0;
  for (int k = 0; k < samples; ++k) {
    const double t = k * data.period_s;
    const double u = 500 + 180 * std::sin(0.9 * t) + 120 * std::sin(2.3 * t + seed);
    const double w = 10 + 70 * std::pow((u - 200) / 600, 1.4);
    x = k == 0 ? w : x + (1 - std::exp(-5 * 0.05)) * (w - x);
    data.input(k) = u;
    data.angle_deg(k) = x + noise(random);
  }
  return data;
}

void expect_plausible(const Summary& s, const Data& data, const std::string& what) {
  const double low = data.angle_deg.minCoeff();
  const double high = data.angle_deg.maxCoeff();
  for (const auto* curve : {&s.channel.input_curve, &s.channel.output_curve}) {
    if (!*curve) continue;
    const auto [least, most] = std::ranges::minmax((*curve)->y);
    EXPECT_GE(least, low - (high - low) - 1e-9) << what;
    EXPECT_LE(most, high + (high - low) + 1e-9) << what;
  }
}

bool refuses(const Summary& s, const std::string& start) {
  return std::ranges::any_of(s.refusals, [&](const std::string& r) { return r.starts_with(start); });
}

TEST(CurveBounds, AKnotThatHardlyAnySampleTouchesTakesItsNeighboursValue) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Data data = example(1500, 0.5, seed);
    Options options;
    options.input_knots = {200, 400, 600, data.input.maxCoeff() - 1, 9000};
    const Summary s = fit(blocks_of("curve(5) > lti(1)"), data, options);
    const model::Curve& curve = *s.channel.input_curve;
    EXPECT_NEAR(curve.y[4], curve.y[3], 1e-9);
    EXPECT_TRUE(refuses(s, "curve at 9000 of ring: ")) << ::testing::PrintToString(s.refusals);
    EXPECT_LT(s.rmse_deg, 1);
  }
}

TEST(CurveBounds, KnotsBetweenSamplesLieOnTheLineBetweenTheirNeighbours) {
  Data data = example(1500, 0.3, 1);
  // The sensor jumps over the readings from 420 to 580.
  for (double& u : data.input) u = u < 500 ? 200 + (u - 200) * 220 / 300 : 580 + (u - 500) * 220 / 300;
  Options options;
  options.input_knots = {200, 300, 420, 470, 500, 580, 700, 800};
  const Summary s = fit(blocks_of("curve(8) > lti(1)"), data, options);
  const model::Curve& c = *s.channel.input_curve;
  EXPECT_TRUE(refuses(s, "curve at 470 of ring") || refuses(s, "curve at 500 of ring"));
  expect_plausible(s, data, "hole");
  EXPECT_NEAR(c.y[3], c.y[2] + (c.y[5] - c.y[2]) * 50 / 160, 1e-9);
  EXPECT_NEAR(c.y[4], c.y[2] + (c.y[5] - c.y[2]) * 80 / 160, 1e-9);
  EXPECT_TRUE(std::ranges::is_sorted(c.y));
}

TEST(CurveBounds, PoorRecordingsGiveNoAbsurdCurves) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    const Data data = example(260, 6, seed);
    for (const Structure& structure : {blocks_of("curve(16) > lti(3)"), blocks_of("lti(3) > curve(16)"),
                                       blocks_of("curve(16) > lti(3) > saturation"),
                                       blocks_of("hysteresis(4) > curve(16) > lti(2) > saturation")}) {
      expect_plausible(fit(structure, data), data, text_of(structure) + " seed " + std::to_string(seed));
    }
  }
}

}  // namespace
}  // namespace flexor::identify
