// Known systems, simulated by equations of their own, must be recovered with honest standard errors.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <random>

#include "host/identify/fit.hpp"
#include "host/identify/structure_text.hpp"
#include "host/io/numbers.hpp"

namespace flexor::identify {
namespace {

constexpr double kPeriod_s = 0.05;
constexpr int kSamples = 3000;
constexpr int kSeeds = 100;

struct Truth {
  const char* name;
  Structure structure;
  std::vector<double> knots;   // of the input curve; none: gain and offset
  std::vector<double> values;  // in the order of Summary::parameters
  double correlation = 0;      // of the noise, from sample to sample

  friend std::ostream& operator<<(std::ostream& out, const Truth& t) { return out << t.name; }
};

std::vector<Truth> truths(double correlation) {
  Structure everything = blocks_of("curve(5) > lti(1) > saturation");
  everything.dead_zone = true;  // before the curve
  return {{"DeadZone", blocks_of(kPublishedForm), {}, {380, 520, 0.12, 55, -4, 30, 88}, correlation},
          {"DeadZoneAndCurve",
           everything,
           {-300, -120, 0, 200, 400},
           {400, 500, 0, 32, 50, 72, 118, -6, 15, 100},
           correlation},
          {"ComplexPair",
           blocks_of("gain > pair > saturation"),
           {},
           {0.12, -4, 6, 0.4, 0.2, 0.5, 20, 100},
           correlation},
          {"Hysteresis",
           blocks_of("hysteresis(1) > curve(5) > lti(1) > saturation"),
           {60, 250, 480, 700, 960},
           {60, 0.6, 5, 38, 52, 80, 112, -5, 30, 88},
           correlation}};
}

// A finger that goes to random places at random speeds, rests, and covers the whole range.
Eigen::VectorXd random_motion(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform;
  Eigen::VectorXd u(kSamples);
  int k = 0;
  double from = 500;
  while (k < kSamples) {
    const double to = 30 + 970 * uniform(random);
    const int steps = 3 + static_cast<int>(30 * uniform(random));
    for (int i = 1; i <= steps && k < kSamples; ++i) u(k++) = from + (to - from) * i / steps;
    const int rest = static_cast<int>(12 * uniform(random));
    for (int i = 0; i < rest && k < kSamples; ++i) u(k++) = to;
    from = to;
  }
  return u;
}

Data simulate(const Truth& t, unsigned seed) {
  std::mt19937 random(seed);
  Data data;
  data.channel = "index";
  data.period_s = kPeriod_s;
  data.input = random_motion(random);
  data.angle_deg.resize(kSamples);
  data.weight.setOnes(kSamples);
  auto next = t.values.begin();
  const double dead_lower = t.structure.dead_zone ? *next++ : 0;
  const double dead_upper = t.structure.dead_zone ? *next++ : 0;
  const double radius = t.structure.plays > 0 ? *next++ : 0;
  const double weight = t.structure.plays > 0 ? *next++ : 0;
  const bool pair = t.structure.pair;
  const std::vector<double> curve(next, t.values.end() - (pair ? 6 : 3));
  const double hold = std::exp(t.values.end()[-3] * kPeriod_s);
  const double lower_deg = t.values.end()[-2];
  const double upper_deg = t.values.back();
  std::normal_distribution<double> noise(0, 0.01 * (upper_deg - lower_deg));
  double play = 0, x = 0, velocity = 0, error = noise(random);
  for (int k = 0; k < kSamples; ++k) {
    double v = data.input(k);
    if (t.structure.dead_zone) v = v < dead_lower ? v - dead_lower : (v > dead_upper ? v - dead_upper : 0);
    if (k == 0) play = v;
    play = std::min(v + radius, std::max(v - radius, play));
    v += weight * (play - v);
    const double w = t.knots.empty() ? curve[0] * v + curve[1] : io::interpolate(t.knots, curve, v);
    double y = x = k == 0 ? w : pair ? x : hold * x + (1 - hold) * w;
    if (pair) {
      constexpr int kParts = 200;
      const double* p = &t.values.end()[-6];  // frequency, damping, taps
      for (int i = 0; i < kParts; ++i) {
        velocity += p[0] * (w - x - 2 * p[1] * velocity) * kPeriod_s / kParts;
        x += p[0] * velocity * kPeriod_s / kParts;
      }
      y = x + p[2] * (w - x) + p[3] * velocity;
    }
    data.angle_deg(k) = std::clamp(y, lower_deg, upper_deg) + error;
    error = t.correlation * error + std::sqrt(1 - t.correlation * t.correlation) * noise(random);
  }
  return data;
}

class Recovery : public testing::TestWithParam<Truth> {};

TEST_P(Recovery, EveryParameterWithinThreeOfItsHonestStandardErrors) {
  const Truth& truth = GetParam();
  const std::vector<double>& expected = truth.values;
  std::vector<int> within(expected.size(), 0);
  std::vector<double> squared(expected.size(), 0);
  std::vector<double> bias(expected.size(), 0);  // in standard errors
  std::vector<Parameter> last;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    Options options;
    if (!truth.knots.empty()) options.knots = Knots{truth.knots, {}};
    const Summary s = fit(truth.structure, simulate(truth, seed), options);
    ASSERT_EQ(s.parameters.size(), expected.size());
    ASSERT_TRUE(std::ranges::none_of(s.parameters, &Parameter::refused)) << "seed " << seed;
    last = s.parameters;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double z = (last[i].value - expected[i]) / last[i].standard_error;
      within[i] += std::abs(z) <= 3;
      squared[i] += z * z / kSeeds;
      bias[i] += z / kSeeds;
    }
  }
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double spread = std::sqrt(squared[i]);  // of the estimates, in reported standard errors
    EXPECT_GE(within[i], 95) << last[i].name;
    EXPECT_GT(spread, 0.7) << last[i].name;
    EXPECT_LT(spread, truth.correlation > 0 ? 1.4 : 1.3) << last[i].name;
    EXPECT_LT(std::abs(bias[i]), 0.5) << last[i].name;
    RecordProperty(last[i].name,
                   std::to_string(within[i]) + " within three, spread " + std::to_string(spread));
    std::printf("%-28s %3d within three, spread %.2f\n", last[i].name.c_str(), within[i], spread);
  }
}

std::string name_of(const testing::TestParamInfo<Truth>& instance) { return instance.param.name; }

INSTANTIATE_TEST_SUITE_P(Systems, Recovery, testing::ValuesIn(truths(0)), name_of);

// Noise that comes in runs, as a camera's does.
INSTANTIATE_TEST_SUITE_P(Coloured, Recovery, testing::ValuesIn(truths(0.95)), name_of);

}  // namespace
}  // namespace flexor::identify
