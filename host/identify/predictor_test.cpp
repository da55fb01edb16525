#include "host/identify/predictor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <random>

#include "host/identify/structure_text.hpp"
#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

struct Case {
  const char* name;
  Structure structure;
  Knots knots;
  std::vector<double> theta;

  friend std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }
};

std::vector<Case> cases() {
  const std::vector<double> y = {10, 22, 31, 55, 90};
  const std::vector<double> x = {100, 250, 500, 600, 900};
  Structure everything = blocks_of("hysteresis(2) > curve(5) > lti(3) > saturation");
  everything.dead_zone = true;
  everything.output_knots = 3;
  return {
      {"linear", blocks_of("linear"), {}, {0.1, -5}},
      {"linear_dynamic", blocks_of("gain > lti(3)"), {}, {0.1, -5, 2.5, 0.3, -1, 0.7, 0.4}},
      {"hammerstein", blocks_of("curve(5) > lti(2)"), {x, {}}, {10, 22, 31, 55, 90, 2, 0.1, 0.6}},
      {"wiener", blocks_of("lti(2) > curve(5)"), {{}, x}, {2, 0.1, 0.6, 10, 22, 31, 55, 90}},
      {"dead_zone", blocks_of(kPublishedForm), {}, {300, 120, 0.12, 40, 1.2, 30, 80}},
      {"hysteresis",
       blocks_of("hysteresis(2) > curve(5) > lti(1) > saturation"),
       {x, {}},
       {8, 40, 0.4, -0.3, 10, 22, 31, 55, 90, 1.1, 14, 70}},
      {"pair",
       blocks_of("curve(5) > pair > saturation"),
       {x, {}},
       {10, 22, 31, 55, 90, 1.5, 0.4, 0.2, -0.3, 14, 70}},
      {"everything", everything, {{-200, -50, 0, 150, 400}, {0, 50, 100}}, {300, 120,  8,  40, 0.4, 0.3, 10,
                                                                            22,  31,   55, 90, 2,   1,   -0.5,
                                                                            0.3, -0.2, 5,  45, 99,  40,  60}},
  };
}

Eigen::VectorXd excitation() {
  std::mt19937 random(4);
  std::normal_distribution<double> noise;
  Eigen::VectorXd u(600);
  double value = 500;
  double velocity = 0;
  for (double& sample : u) {
    velocity = 0.9 * velocity + 12 * noise(random);
    value = std::clamp(value + velocity, 120.0, 880.0);
    sample = value;
  }
  return u;
}

class PredictorCase : public testing::TestWithParam<Case> {
 protected:
  Eigen::VectorXd at(Eigen::Index i, double h) const {
    Eigen::VectorXd out = theta;
    out(i) += h;
    return out;
  }

  const Case& c = GetParam();
  const Predictor predictor{c.structure, c.knots, excitation(), 0.05};
  const Eigen::VectorXd theta = Eigen::Map<const Eigen::VectorXd>(c.theta.data(), std::ssize(c.theta));
};

TEST_P(PredictorCase, JacobianMatchesCentralDifferences) {
  ASSERT_EQ(theta.size(), predictor.layout().size);
  Jacobian jacobian;
  const Eigen::VectorXd y = predictor.predict(theta, &jacobian);
  EXPECT_EQ(y, predictor.predict(theta, nullptr));
  for (int i = 0; i < theta.size(); ++i) {
    const double h = 1e-5 * std::max(1.0, std::abs(theta(i)));
    const Eigen::VectorXd numeric =
        (predictor.predict(at(i, h), nullptr) - predictor.predict(at(i, -h), nullptr)) / (2 * h);
    // A sample on a kink may differ; there are only a few.
    const double scale = std::max(numeric.cwiseAbs().maxCoeff(), 1e-9);
    const auto wrong = ((jacobian.col(i) - numeric).array().abs() > 1e-4 * scale).count();
    EXPECT_LE(wrong, 6) << c.name << " parameter " << i;
    EXPECT_GT(jacobian.col(i).norm(), 0) << c.name << " parameter " << i;
  }
}

TEST_P(PredictorCase, TheModelDocumentPredictsTheSame) {
  model::Channel channel = predictor.channel(theta);
  channel.name = "index";
  if (!c.structure.saturation) channel.saturation = {-1000, 1000};
  model::Compensator<model::DoubleArithmetic> simulation(model::model_of(channel, 0.05));
  const Eigen::VectorXd y = predictor.predict(theta, nullptr);
  for (Eigen::Index k = 0; k < y.size(); ++k)
    ASSERT_NEAR(simulation.step(predictor.input()(k)).angle_deg, y(k), 1e-9) << k;
  EXPECT_TRUE(predictor.theta(channel).isApprox(theta, 1e-12));
}

TEST_P(PredictorCase, EveryNamedParameterHasItsGradient) {
  const auto named = predictor.named(theta);
  ASSERT_EQ(std::ssize(named), theta.size());
  for (int i = 0; i < theta.size(); ++i) {
    const double h = 1e-6;
    const auto moved = predictor.named(at(i, h));
    for (std::size_t k = 0; k < named.size(); ++k) {
      EXPECT_NEAR((moved[k].value - named[k].value) / h, named[k].gradient(i),
                  1e-4 * std::max(1.0, std::abs(named[k].value)))
          << named[k].name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Structures, PredictorCase, testing::ValuesIn(cases()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace flexor::identify
