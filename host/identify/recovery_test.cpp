// Known systems, simulated by equations of their own, must be recovered with honest standard errors.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <random>

#include "host/identify/fit.hpp"
#include "host/identify/structure_text.hpp"

namespace flexor::identify {
namespace {

constexpr double kPeriod_s = 0.05;
constexpr int kSamples = 3000;
constexpr int kSeeds = 100;

struct Truth {
  const char* name;
  Structure structure;
  std::vector<double> knots;  // of the input curve
  double dead_lower = 0;
  double dead_upper = 0;
  double radius = 0;
  double weight = 0;
  std::vector<double> values = {};  // at the knots; empty: gain and offset
  double gain = 0;
  double offset = 0;
  double pole_rad_s = 0;
  double lower_deg = 0;
  double upper_deg = 0;
  double correlation = 0;  // of the noise, from sample to sample

  friend std::ostream& operator<<(std::ostream& out, const Truth& t) { return out << t.name; }
};

Truth dead_zone_truth() {
  Truth t{"DeadZone", blocks_of(kPublishedForm), {}};
  t.dead_lower = 380;
  t.dead_upper = 520;
  t.gain = 0.12;
  t.offset = 55;
  t.pole_rad_s = -4;
  t.lower_deg = 30;
  t.upper_deg = 88;
  return t;
}

// Everything at once: dead zone, curve behind it, pole, saturation.
Truth dead_zone_and_curve_truth() {
  Truth t{"DeadZoneAndCurve", blocks_of("curve(5) > lti(1) > saturation"), {-300, -120, 0, 200, 400}};
  t.structure.dead_zone = true;
  t.dead_lower = 400;
  t.dead_upper = 500;
  t.values = {0, 32, 50, 72, 118};
  t.pole_rad_s = -6;
  t.lower_deg = 15;
  t.upper_deg = 100;
  return t;
}

Truth hysteresis_truth() {
  Truth t{
      "Hysteresis", blocks_of("hysteresis(1) > curve(5) > lti(1) > saturation"), {60, 250, 480, 700, 960}};
  t.radius = 60;
  t.weight = 0.6;
  t.values = {5, 38, 52, 80, 112};
  t.pole_rad_s = -5;
  t.lower_deg = 30;
  t.upper_deg = 88;
  return t;
}

double curve_at(const Truth& t, double u) {
  const auto& x = t.knots;
  if (u <= x.front()) return t.values.front();
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (u < x[i])
      return t.values[i - 1] + (t.values[i] - t.values[i - 1]) * (u - x[i - 1]) / (x[i] - x[i - 1]);
  }
  return t.values.back();
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
  data.use.assign(kSamples, 1);
  const double hold = std::exp(t.pole_rad_s * kPeriod_s);
  std::normal_distribution<double> noise(0, 0.01 * (t.upper_deg - t.lower_deg));
  double play = 0;
  double x = 0;
  double error = noise(random);
  for (int k = 0; k < kSamples; ++k) {
    double v = data.input(k);
    if (t.structure.dead_zone)
      v = v < t.dead_lower ? v - t.dead_lower : (v > t.dead_upper ? v - t.dead_upper : 0);
    if (k == 0) play = v;
    play = std::min(v + t.radius, std::max(v - t.radius, play));
    v += t.weight * (play - v);
    const double w = t.values.empty() ? t.gain * v + t.offset : curve_at(t, v);
    x = k == 0 ? w : hold * x + (1 - hold) * w;
    data.angle_deg(k) = std::clamp(x, t.lower_deg, t.upper_deg) + error;
    error = t.correlation * error + std::sqrt(1 - t.correlation * t.correlation) * noise(random);
  }
  return data;
}

// In the order of Summary::parameters.
std::vector<double> true_values(const Truth& t) {
  std::vector<double> all;
  if (t.structure.dead_zone) all.insert(all.end(), {t.dead_lower, t.dead_upper});
  if (t.structure.plays > 0) all.insert(all.end(), {t.radius, t.weight});
  if (t.values.empty()) {
    all.insert(all.end(), {t.gain, t.offset});
  } else {
    all.insert(all.end(), t.values.begin(), t.values.end());
  }
  all.insert(all.end(), {t.pole_rad_s, t.lower_deg, t.upper_deg});
  return all;
}

class Recovery : public testing::TestWithParam<Truth> {};

TEST_P(Recovery, EveryParameterWithinThreeOfItsHonestStandardErrors) {
  const Truth& truth = GetParam();
  const auto expected = true_values(truth);
  std::vector<int> within(expected.size(), 0);
  std::vector<double> squared(expected.size(), 0);
  std::vector<double> bias(expected.size(), 0);  // in standard errors
  std::vector<std::string> names;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    Options options;
    if (!truth.knots.empty()) options.knots = Knots{truth.knots, {}};
    const Summary s = fit(truth.structure, simulate(truth, seed), options);
    ASSERT_EQ(s.parameters.size(), expected.size());
    ASSERT_TRUE(s.refusals.empty()) << "seed " << seed << ": " << s.refusals.front();
    names.clear();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const Parameter& p = s.parameters[i];
      const double z = (p.value - expected[i]) / p.standard_error;
      within[i] += std::abs(z) <= 3;
      squared[i] += z * z / kSeeds;
      bias[i] += z / kSeeds;
      names.push_back(p.name);
    }
  }
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_GE(within[i], 95) << names[i];
    // The spread of the estimates, in reported standard errors.
    EXPECT_GT(std::sqrt(squared[i]), 0.7) << names[i];
    EXPECT_LT(std::sqrt(squared[i]), truth.correlation > 0 ? 1.4 : 1.3) << names[i];
    EXPECT_LT(std::abs(bias[i]), 0.5) << names[i];
    RecordProperty(names[i], std::to_string(within[i]) + " within three, spread " +
                                 std::to_string(std::sqrt(squared[i])));
    std::printf("%-28s %3d within three, spread %.2f\n", names[i].c_str(), within[i], std::sqrt(squared[i]));
  }
}

INSTANTIATE_TEST_SUITE_P(Systems, Recovery,
                         testing::Values(dead_zone_truth(), dead_zone_and_curve_truth(), hysteresis_truth()),
                         [](const auto& instance) { return std::string(instance.param.name); });

// Noise that comes in runs, as a camera's does.
Truth coloured(Truth t) {
  t.correlation = 0.95;
  return t;
}

INSTANTIATE_TEST_SUITE_P(Coloured, Recovery,
                         testing::Values(coloured(dead_zone_truth()), coloured(dead_zone_and_curve_truth()),
                                         coloured(hysteresis_truth())),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace flexor::identify
