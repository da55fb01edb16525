#include "host/identify/additive.hpp"
#include "host/identify/structure_text.hpp"

#include <cmath>
#include <random>

#include "host/identify/identify_test.hpp"
#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

constexpr double kGrid_s = 0.05;

// One motion, the same for every seed; the seed draws the noise of the angle, white or in runs.
Session drawn(unsigned seed, double memory, double offset_deg = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  double run = 0;
  return sampled(2400, [&](Eigen::Index k) {
    const auto t = static_cast<double>(k) * kGrid_s;
    const double share = 0.5 + 0.25 * std::sin(0.9 * t) + 0.24 * std::sin(0.37 * t + 1);
    run = memory * run + std::sqrt(1 - memory * memory) * noise(random);
    return std::pair{300 + 400 * share, 90 * share * share + offset_deg + 0.5 * run};
  });
}

Additive fit_of(const std::vector<Session>& sessions, const std::string& structure) {
  const auto still = [](const Additive&) { return 0.0; };
  const auto any = [](const Additive&) { return true; };
  const auto wanted = std::get<Candidates>(parse_structure(structure, 1));
  return fit_additive(sessions, kGrid_s, "index", wanted, still, any, {}).front();
}

TEST(Additive, StandardErrorsAreTheSpreadOfRepeatedRecordings) {
  for (const double memory : {0.0, 0.95}) {
    constexpr int kSeeds = 40;
    Eigen::ArrayXXd value(kSeeds, 3), variance(kSeeds, 3);  // at knots that readings surround
    for (int seed = 0; seed < kSeeds; ++seed) {
      const Additive one = fit_of({drawn(static_cast<unsigned>(seed), memory)}, "curve");
      for (const Eigen::Index k : {0, 1, 2}) {
        value(seed, k) = one.offset_deg + one.value(3 + 3 * k, 0);
        variance(seed, k) = one.covariance(3 + 3 * k, 3 + 3 * k);
      }
    }
    for (const Eigen::Index k : {0, 1, 2}) {
      const double spread = (value.col(k) - value.col(k).mean()).square().sum() / (kSeeds - 1);
      const double ratio = std::sqrt(variance.col(k).mean() / spread);
      EXPECT_GT(ratio, 0.7) << "memory " << memory << ", knot " << 3 + 3 * k;
      EXPECT_LT(ratio, 1.5) << "memory " << memory << ", knot " << 3 + 3 * k;
    }
  }
}

TEST(Additive, WhatDiffersBetweenRecordingsStaysOutOfTheCurves) {
  const Additive fit = fit_of({drawn(1, 0, -6), drawn(2, 0, 0), drawn(3, 0, 6)}, "curve");
  ASSERT_EQ(fit.donning.size(), 6) << "an offset and a slope each";
  EXPECT_NEAR(fit.donning(4) - fit.donning(0), 12, 2.5);
  const Additive one = fit_of({drawn(2, 0, 0)}, "curve");
  EXPECT_EQ(one.donning.size(), 0);
  for (const Eigen::Index knot : {3, 6, 9})
    EXPECT_NEAR(fit.offset_deg + fit.value(knot, 0), one.offset_deg + one.value(knot, 0), 1);
}

// How far the angle goes back while the reading goes up slowly, after it went down, or the other way round.
double turned_deg(const Additive& fit) {
  model::Model model;
  model.sample_period_s = kGrid_s;
  model.inputs = {{"u", "u", "count", "", 1, 1022}};
  add_to(model, fit, {"u"}, "index");
  model::Compensator<model::DoubleArithmetic> compensator(model);
  double most = 0, farthest = 0;
  for (int k = 0; k < 3 * 720; ++k) {
    const double angle = compensator.step(320.0 + std::abs(k % 720 - 360)).angle_deg;
    const double forward = k % 720 > 360 ? angle : -angle;
    if (k % 360 == 1) farthest = forward;
    farthest = std::max(farthest, forward);
    if (k > 720 && k % 360 > 0) most = std::max(most, farthest - forward);
  }
  return most;
}

TEST(Additive, ACurveTurnsBackOnlyWhereTheDataSaySoBeyondDoubt) {
  for (const char* structure :
       {"curve(12)", "curve + play(0.03) > curve + play(0.08) > curve + play(0.16) > curve"}) {
    for (unsigned seed = 0; seed < 10; ++seed) {
      Session level = drawn(seed, 0.9);
      for (Eigen::Index k = 0; k < level.angle_deg.size(); ++k) {
        const double share = (level.input(k, 0) - 300) / 400;
        const double noise = level.angle_deg(k) - 90 * share * share;
        level.angle_deg(k) = 45 + 40 * std::pow(2 * share - 1, 5) + 4 * noise;
      }
      EXPECT_LT(turned_deg(fit_of({level}, structure)), 0.1) << structure << ", seed " << seed;
      Session bent = drawn(seed, 0);
      for (Eigen::Index k = 0; k < bent.angle_deg.size(); ++k)
        bent.angle_deg(k) -= 150 * std::max(0.0, (bent.input(k, 0) - 550) / 400);
      EXPECT_GT(turned_deg(fit_of({bent}, structure)), 1) << structure << ", seed " << seed;
    }
  }
}

TEST(Additive, AnAngleGoesOnBeyondWhatWasSeenUnlessLimitsAreBetter) {
  int open = 0;
  for (unsigned seed = 0; seed < 6; ++seed) {
    Session goes_on = drawn(seed, 0), stops = goes_on;
    const Eigen::ArrayXd share = (stops.input.col(0).array() - 300) / 400;
    goes_on.angle_deg.array() += 100 * share.sin() - 90 * share.square();
    stops.angle_deg = (120 * (share - 0.25)).max(0).min(60);  // the sensor goes on
    open += fit_of({goes_on}, "auto").branches.open;
    EXPECT_EQ(text_of(fit_of({stops}, "auto").branches), "curve(2)") << seed;
  }
  EXPECT_GE(open, 4);
}

TEST(Additive, AnEndBeyondWhichNoEstimateLiesHasNoLimit) {
  Session stops = drawn(1, 0);
  stops.angle_deg = (120 * (stops.input.col(0).array() - 300) / 400).min(60);
  const model::Saturation limits = fit_of({stops}, "curve(2)").limits;
  EXPECT_NEAR(limits.upper_deg, 60, 0.1);
  EXPECT_LT(limits.lower_deg, stops.angle_deg.minCoeff() - 40);
}

TEST(Additive, OfSeveralSensorsTheSmallestWithinAStandardErrorComesFirst) {
  std::vector<Additive> two(2);
  two[0].value.resize(12, 4);
  two[1].value.resize(2, 4);
  two[0].fold_loss = {1, 2, 3};
  two[1].fold_loss = {1.8, 1.9, 3.1};  // larger by 13 %, less than a standard error
  for (Additive& one : two) one.knots.resize(2);
  two[0].cross_validated_deg = 1;
  two[1].cross_validated_deg = 1.09;
  rank(two.begin(), two.end());
  EXPECT_EQ(two[0].value.rows(), 2);
  for (Additive& one : two) one.knots.resize(1);
  rank(two.begin(), two.end());
  EXPECT_EQ(two[0].value.rows(), 12) << "of one sensor a larger one is taken for 3 % less";
}

TEST(Additive, MotionThatDriftsIsShrunkUntilItDoesNot) {
  double next_deg = 5;
  const auto drift = [&](const Additive&) { return std::exchange(next_deg, 0.5); };
  const auto any = [](const Additive&) { return true; };
  const auto before = fit_of({drawn(5, 0)}, "line-lead");
  const auto after =
      fit_additive({drawn(5, 0)}, kGrid_s, "index", candidates("line-lead", 1), drift, any, {}).front();
  EXPECT_EQ(*after.hold_drift_deg, 0.5);
  EXPECT_GT(after.priors.motion, before.priors.motion);
}

}  // namespace
}  // namespace flexor::identify
