#include "host/identify/fit.hpp"
#include "host/identify/structure_text.hpp"

#include <cmath>
#include <ostream>
#include <random>

#include "host/identify/identify_test.hpp"
#include "host/identify/robust.hpp"
#include "host/io/numbers.hpp"
#include "host/io/refusal_test.hpp"

namespace flexor::identify {
namespace {

// A smooth motion through a gentle curve; range of the sensor 200..800, of the angle about 10..80, but
// for the third quarter a part of that.
Data example(int samples = 1500, double noise_deg = 0.3, unsigned seed = 1, double elsewhere = 1) {
  std::mt19937 random(10 + seed);
  std::normal_distribution<double> noise(0, noise_deg);
  Data data;
  data.channel = "ring";
  data.period_s = 0.05;
  data.input.resize(samples);
  data.angle_deg.resize(samples);
  data.weight.setOnes(samples);
  double x = 0;
  for (int k = 0; k < samples; ++k) {
    const double t = k * data.period_s;
    const double part = 4 * k / samples == 2 ? 1 : elsewhere;
    const double u = 500 + part * 180 * std::sin(0.9 * t) + part * 120 * std::sin(2.3 * t + seed);
    const double w = 10 + 70 * std::pow((u - 200) / 600, 1.4);
    x = k == 0 ? w : x + (1 - std::exp(-5 * 0.05)) * (w - x);
    data.input(k) = u;
    data.angle_deg(k) = x + noise(random);
  }
  return data;
}

bool refuses(const Summary& s, const std::string& name) {
  return std::ranges::find(s.parameters, name, &Parameter::name)->refused;
}

TEST(Fit, InitialValuesAreOneStartMore) {
  const Data data = example();
  const Structure structure = blocks_of("curve(8) > lti(2) > saturation");
  const Summary first = fit(structure, data);
  ChainOptions options;
  options.initial = Initial{first.channel};
  options.from = From::initial;
  const Summary again = fit(structure, data, options);
  EXPECT_NEAR(again.fitted_rmse_deg, first.fitted_rmse_deg, 1e-5);
  EXPECT_LT(again.iterations, first.iterations);
  for (std::size_t k = 0; k < first.parameters.size(); ++k)
    EXPECT_NEAR(*again.parameters[k].initial, first.parameters[k].value, 1e-9) << first.parameters[k].name;
  EXPECT_THROW(fit(blocks_of("curve(8) > lti(1) > saturation"), data, options), io::InputError);
}

TEST(Fit, EveryFamilyFitsAndTheRicherOnesFitBetter) {
  const Data data = example();
  double linear = 0;
  for (const std::string text : {"linear", "linear-dynamic", "hammerstein", "wiener", "hw", "hysteresis-hw",
                                 "curve > pair", "curve > lti(1) > curve"}) {
    const Summary s = fit(blocks_of(text), data);
    if (text == "linear") linear = s.fitted_rmse_deg;
    EXPECT_LE(s.fitted_rmse_deg, linear * 1.0001) << text;
    EXPECT_TRUE(s.predicted_deg.allFinite());
    if (!text.starts_with("linear")) {
      EXPECT_LT(s.fitted_rmse_deg, 0.5) << text;
      EXPECT_GT(s.fitted_rmse_deg, 0.25) << text << " cannot beat the noise";
    }
  }
}

TEST(Fit, TheRobustLossShrugsOffATrackersGlitches) {
  Data clean = example();
  Data dirty = clean;
  for (int k = 50; k < 1500; k += 50) dirty.angle_deg(k) += 40;
  const Structure structure = blocks_of("curve(10) > lti(1)");
  const auto distance = [&](const Summary& s) {
    return (s.predicted_deg - fit(structure, clean).predicted_deg).norm() / std::sqrt(1500.0);
  };
  EXPECT_LT(distance(fit(structure, dirty)), 0.1);
}

TEST(Fit, ASaturationThatIsNeverReachedIsRefusedByName) {
  const Summary s = fit(blocks_of("curve(10) > lti(1) > saturation"), example());
  EXPECT_EQ(std::ranges::count(s.parameters, true, &Parameter::refused), 2);
  EXPECT_TRUE(refuses(s, "saturation lower limit"));
  EXPECT_LT(s.channel.saturation.lower_deg, example().angle_deg.minCoeff());
  EXPECT_GT(s.channel.saturation.upper_deg, example().angle_deg.maxCoeff());
  EXPECT_TRUE(refuses(s, "saturation upper limit"));
}

TEST(Fit, ACurveGoesOnStraightBeyondWhatWasRead) {
  const Data data = example();
  const model::Curve curve = *fit(blocks_of("curve(10) > lti(1)"), data).channel.input_curve;
  const double range = data.input.maxCoeff() - data.input.minCoeff();
  EXPECT_GT(curve.x.back(), data.input.maxCoeff() + 0.2 * range);
  EXPECT_GT(curve(curve.x.back()) - curve(data.input.maxCoeff()), 5);
  EXPECT_LT(curve(curve.x.front()) - curve(data.input.minCoeff()), -5);
}

TEST(Fit, ADeadZoneEdgeWithoutSamplesIsRefusedByName) {
  Data data = example();
  data.angle_deg = 10 + 0.1 * (data.input.array() - 400).max(0);
  const Summary s = fit(blocks_of(kPublishedForm), data);
  EXPECT_TRUE(refuses(s, "dead zone lower edge"));
  EXPECT_NEAR(s.channel.dead_zone->upper, 400, 5);
}

TEST(Fit, AGainAloneIsFoundWhereverTheDeadZoneEndedBefore) {
  Data data = example();
  data.angle_deg = 10 + 0.1 * (data.input.array() - 400).max(0);
  const Structure structure = blocks_of(kPublishedForm);
  ChainOptions options;
  options.from = From::initial;
  options.initial = Initial{fit(structure, data).channel, true};
  const std::vector<double> poles = options.initial->chain.lti.poles_rad_s;
  options.initial->chain.dead_zone->upper = 5000;  // beyond all readings
  options.initial->chain.lti.gain = 0.001;         // below its lower limit
  const Summary s = fit(structure, data, options);
  EXPECT_NEAR(s.channel.dead_zone->upper, 400, 5);
  EXPECT_NEAR(s.channel.lti.gain, 0.1, 0.005);
  EXPECT_EQ(s.channel.lti.poles_rad_s, poles);
}

TEST(Fit, RefusesTooFewSamplesAndSignalsThatDoNotMove) {
  const auto reason = [](const Data& data) {
    return io::refusal_of<io::JobError>([&] { (void)fit(blocks_of("hw"), data); });
  };
  Data few = example();
  few.weight.tail(few.weight.size() - 60).setZero();
  EXPECT_TRUE(has(reason(few), "ring: 60 usable samples are too few for the 15 parameters"));
  Data still = example();
  still.input.setConstant(5);
  EXPECT_TRUE(has(reason(still), "ring: the sensor does not change"));
  still = example();
  still.angle_deg.setConstant(5);
  EXPECT_TRUE(has(reason(still), "ring: the angle does not change"));
}

// A curve that was fitted never says angles that the finger cannot have had.
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

TEST(CurveBounds, AKnotThatHardlyAnySampleTouchesGoesOnAsFarAsIsPlausible) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Data data = example(1500, 0.5, seed);
    ChainOptions options;
    options.knots = Knots{{200, 400, 600, data.input.maxCoeff() - 1, 9000}, {}};
    const Summary s = fit(blocks_of("curve(5) > lti(1)"), data, options);
    EXPECT_GT(s.channel.input_curve->y[4], s.channel.input_curve->y[3]);
    expect_plausible(s, data, "beyond");
    EXPECT_LT(s.fitted_rmse_deg, 1);
  }
}

TEST(CurveBounds, PoorRecordingsGiveNoAbsurdCurves) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    const Data data = example(260, 6, seed);
    for (const std::string text :
         {"curve(16) > lti(3)", "lti(3) > curve(16)", "curve(16) > lti(3) > saturation",
          "hysteresis(4) > curve(16) > lti(2) > saturation"})
      expect_plausible(fit(blocks_of(text), data), data, text + " seed " + std::to_string(seed));
  }
}

// What cross-validation leaves out must not help to choose the fold's knots, its start or its parameters.
TEST(HeldBack, OtherAnglesAndReadingsInABlockDoNotMoveTheFoldThatLeavesItOut) {
  const Data data = example(1000, 0.3, 1, 0.5);
  const std::vector<Fold> all = folds_of(used_rows(data), {0, data.size()}, data.period_s);
  Data angles = data;
  Data readings = data;
  for (Eigen::Index k = all[2].front().first; k <= all[2].front().last; ++k) {
    angles.angle_deg(k) = 200 - 3 * data.angle_deg(k);
    readings.input(k) = 2000 + 500 * std::sin(0.2 * static_cast<double>(k));
  }
  for (const char* text :
       {"curve(6) > lti(1)", "lti(1) > curve(6)", "hysteresis(1) > curve(6) > lti(1) > saturation"}) {
    const Structure structure = blocks_of(text);
    const std::vector<Summary> before = fit_folds(structure, data, {all[1], all[2]}, {});
    const std::vector<Summary> after = fit_folds(structure, angles, {all[1], all[2]}, {});
    EXPECT_EQ(after[1].theta, before[1].theta) << text;
    EXPECT_EQ(after[1].knots.input, before[1].knots.input);
    EXPECT_NE(after[0].theta, before[0].theta) << "the other folds do see it";
    // The state of hysteresis and lags runs through the block; after the guard nothing of it may be left in the
    // knots, and next to nothing in the parameters.
    const Summary third = fit_folds(structure, readings, {all[2]}, {}).front();
    EXPECT_EQ(third.knots.input, before[1].knots.input) << text;
    EXPECT_EQ(third.knots.output, before[1].knots.output) << text;
    EXPECT_NEAR(third.fitted_rmse_deg, before[1].fitted_rmse_deg, 0.02) << text;
  }
}

// Of parameters that so many residuals determine, each `memory` times the one before and noise.
Eigen::VectorXd errors_of(const Eigen::MatrixXd& jacobian, double noise, double memory) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0, noise);
  Eigen::VectorXd residual(jacobian.rows());
  double e = 0;
  for (double& r : residual) r = e = memory * e + normal(random);
  const auto u = uncertainty(residual, jacobian, std::numeric_limits<double>::infinity(),
                             Eigen::MatrixXd(0, jacobian.cols()));
  return u.covariance.diagonal().cwiseSqrt();
}

// One error far below the others' size must not end a fit: rounding took its slope to infinity.
TEST(Fit, TheLossIsFiniteAndSteadyForErrorsOfAnySize) {
  for (const double r : {0.0, 1e-300, 1e-12, 5e-9, 1e-8, 1e-4, 1.0, 1e9}) {
    const Bent bent = bend(-r, 1);
    EXPECT_NEAR(bent.value, -r * std::sqrt(2 / (std::sqrt(1 + r * r) + 1)), 1e-12 * r) << r;
    EXPECT_LE(bent.slope, 1) << r;
    EXPECT_GT(bent.slope, 0) << r;
  }
}

TEST(Uncertainty, IsTheTextbookFormulaForWhiteNoiseAndForNoiseThatLasts) {
  const int n = 20000;
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Ones(n, 2);
  for (int k = 0; k < n; ++k) jacobian(k, 1) = std::sin(0.1 * k);
  const Eigen::VectorXd white = errors_of(jacobian, 0.5, 0);
  EXPECT_NEAR(white(0) * std::sqrt(n) / 0.5, 1, 0.05);
  EXPECT_NEAR(white(1) * std::sqrt(n / 2.0) / 0.5, 1, 0.05);
  const double exact = 1 / (1 - 0.9) / std::sqrt(n);  // of the mean of an AR(1) process
  EXPECT_NEAR(errors_of(Eigen::MatrixXd::Ones(n, 1), 1, 0.9)(0) / exact, 1, 0.2);
}

TEST(Uncertainty, NamesWhatTheDataDoNotDetermine) {
  const Eigen::MatrixXd no_prior(0, 3);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Random(100, 3);
  jacobian.col(1).setZero();
  EXPECT_EQ(uncertainty(jacobian.col(0), jacobian, 1, no_prior).undetermined, std::vector<int>{1});
  jacobian.col(1) = 2 * jacobian.col(2);
  EXPECT_EQ(uncertainty(jacobian.col(0), jacobian, 1, no_prior).undetermined.size(), 1u);
}

// Known systems, simulated by equations of their own, must be recovered with honest standard errors.
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
    ChainOptions options;
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
