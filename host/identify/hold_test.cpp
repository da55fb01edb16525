#include "host/identify/hold.hpp"

#include <cmath>
#include <random>

#include "host/identify/identify_test.hpp"

namespace flexor::identify {
namespace {

constexpr double kStep_s = 0.05;

model::Model lagging(double tau_s) {
  model::Model out;
  out.name = "lag";
  out.sample_period_s = kStep_s;
  out.inputs = {{"u", "u", "deg", "", -1000, 1000}};
  out.blocks = {{{"u"}, "felt", model::Lag{1 / tau_s}}, {{"felt"}, "angle", model::Saturation{-500, 500}}};
  out.joints = {{"index", "angle", 0, {}}};
  return out;
}

// At rest at 0, then at 50, of which the hold that begins at row 2050 (one of forty) has seen ten samples.
Session step() {
  Session out;
  constexpr Eigen::Index kRows = 4000;
  out.input = Eigen::MatrixXd::Zero(kRows, 1);
  out.input.bottomRows(kRows - 2040).setConstant(50);
  return out;
}

TEST(HoldDrift, IsWhatALagStillHasToGoAfterASecond) {
  for (const double tau_s : {0.5, 5.0, 20.0}) {
    const auto left = [&](int samples) { return 50 * std::exp(-samples * kStep_s / tau_s); };
    EXPECT_NEAR(hold_drift_deg(lagging(tau_s), {step()}, {"u"}), left(11 + 21) - left(11 + 1201), 1e-6)
        << tau_s;
  }
}

JointFit fit_of_one(const Session& session) {
  model::Model inputs;
  inputs.sample_period_s = kStep_s;
  inputs.inputs = {{"u", "u", "count", "", 1, 1022}};
  return fit_joint({{session}, inputs, {"index", {"u"}, "angle"}}, "auto");
}

// Three minutes of poses, each held for up to six seconds; a part of what the reading gains comes with 1.5 seconds.
Session poses(double creep) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> noise;
  double goal = 0, angle_deg = 0, slow = 0;
  return sampled(3600, [&, until = Eigen::Index{0}](Eigen::Index k) mutable {
    if (k == until) {
      goal = 90 * uniform(random);
      until += 20 + static_cast<Eigen::Index>(100 * uniform(random));
    }
    angle_deg += std::clamp(goal - angle_deg, -6.0, 6.0);
    slow += (1 - std::exp(-kStep_s / 1.5)) * (angle_deg - slow);
    return std::pair{300 + 4 * ((1 - creep) * angle_deg + creep * slow) + noise(random), angle_deg};
  });
}

TEST(Creep, IsUndoneWhereTheFingersOwnHoldsShowItAndNotElsewhere) {
  const JointFit creeps = fit_of_one(poses(0.2));
  const JointFit still = fit_of_one(poses(0));
  EXPECT_GT(creeps.hold_drift_deg, 1) << "as its reading does";
  EXPECT_LT(creeps.cross_validated_deg, 2 * still.cross_validated_deg) << creeps.structure;
  EXPECT_LT(wander_deg(creeps.model, {poses(0.2)}, {"u"}), 0.5);
  EXPECT_LE(still.hold_drift_deg, 1) << still.structure;
}

// An angle that follows its reading with two seconds, and never comes to rest.
JointFit restless(Eigen::Index rows) {
  std::mt19937 random(3);
  double reading = 500, angle_deg = 50;
  return fit_of_one(sampled(rows, [&](Eigen::Index k) {
    if (k > 0 && k % 20 == 0) reading = 100 + static_cast<double>(random() % 800);
    angle_deg += (1 - std::exp(-kStep_s / 2)) * (reading / 10 - angle_deg);
    return std::pair{reading, angle_deg};
  }));
}

TEST(Creep, IsBelievedWithoutAHoldWhereThePartIsTenTimesAsLong) {
  const JointFit long_enough = restless(1200);
  EXPECT_GT(long_enough.hold_drift_deg, 10);
  EXPECT_LT(long_enough.cross_validated_deg, 2);
  EXPECT_LE(restless(200).hold_drift_deg, 10);
}

TEST(Holds, AreWhereTheFingerMovesByTwoDegreesAtMostForASecond) {
  Session session = step();
  session.angle_deg = session.input.col(0).head(2060);
  session.use.assign(2060, 1);
  session.use[1000] = 0;
  const std::vector<StillPart> holds = holds_of(session, kStep_s);
  ASSERT_EQ(holds.size(), 3U);
  EXPECT_EQ(holds[1].from, 1001);
  EXPECT_EQ(holds[1].to, 2040);
}

TEST(Holds, AreFoundThroughACamerasNoise) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise_deg;
  Session session = step();
  session.angle_deg = session.input.col(0);
  for (double& angle : session.angle_deg) angle += noise_deg(random);
  session.use.assign(4000, 1);
  Eigen::Index held = 0;
  for (const StillPart& one : holds_of(session, kStep_s)) held += one.to - one.from;
  EXPECT_GT(held, 3600);
}

}  // namespace
}  // namespace flexor::identify
