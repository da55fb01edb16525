#include "host/identify/hold.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(HoldDrift, OfWhatHasNoMemoryIsNone) {
  model::Model still = lagging(1);
  still.blocks.front().kind = model::Gain{1, 0};
  EXPECT_EQ(hold_drift_deg(still, {step()}, {"u"}), 0);
}

}  // namespace
}  // namespace flexor::identify
