#include "host/model/discrete.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexor::model {
namespace {

TEST(ZeroOrderHold, FirstOrderIsTheClosedForm) {
  const auto hold = zero_order_hold(Eigen::VectorXd::Constant(1, 54.0), 0.1);
  EXPECT_NEAR(hold.transition(0, 0), std::exp(-5.4), 1e-15);
  EXPECT_NEAR(hold.input(0), 1 - std::exp(-5.4), 1e-15);
}

TEST(ZeroOrderHold, SecondOrderIsTheClosedForm) {
  const double a = 12;
  const double b = 19.6;
  const double t = 0.1;
  const auto hold = zero_order_hold((Eigen::VectorXd(2) << a, b).finished(), t);
  // Response of the chain's second state to a unit step.
  const double step = 1 - (b * std::exp(-a * t) - a * std::exp(-b * t)) / (b - a);
  EXPECT_NEAR(hold.input(1), step, 1e-14);
}

TEST(ZeroOrderHold, EqualAndWidelySpreadPolesAreNoTrouble) {
  const double a = 3;
  const auto equal = zero_order_hold(Eigen::VectorXd::Constant(2, a), 0.1);
  EXPECT_NEAR(equal.transition(1, 0), a * 0.1 * std::exp(-a * 0.1), 1e-14);
  const auto spread = zero_order_hold((Eigen::VectorXd(3) << 10, 34, 7819).finished(), 0.1);
  EXPECT_NEAR(spread.transition(0, 0), std::exp(-1.0), 1e-13);
  EXPECT_LT(spread.transition(2, 2), 1e-300);  // the pinky's fast pole vanishes
}

TEST(ZeroOrderHold, WeightsAreAMean) {
  const auto hold = zero_order_hold((Eigen::VectorXd(3) << 0.3, 8, 8).finished(), 0.05);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GE(hold.input(i), 0);
    EXPECT_GE(hold.transition.row(i).minCoeff(), 0);
    EXPECT_NEAR(hold.transition.row(i).sum() + hold.input(i), 1, 1e-15);
  }
}

TEST(ZeroOrderHold, DerivativeMatchesDifferences) {
  const Eigen::Vector3d rates(0.7, 5, 21);
  const double h = 1e-6;
  for (int i = 0; i < 3; ++i) {
    Eigen::VectorXd up = rates;
    Eigen::VectorXd down = rates;
    up(i) *= std::exp(h);
    down(i) *= std::exp(-h);
    const auto derivative = zero_order_hold_derivative(rates, 0.05, i);
    const auto plus = zero_order_hold(up, 0.05);
    const auto minus = zero_order_hold(down, 0.05);
    EXPECT_LT((derivative.transition - (plus.transition - minus.transition) / (2 * h)).norm(), 1e-8);
    EXPECT_LT((derivative.input - (plus.input - minus.input) / (2 * h)).norm(), 1e-8);
  }
}

}  // namespace
}  // namespace flexor::model
