// Certified parameters of NIST's Statistical Reference Datasets (nonlinear regression), from the certified starts.
#include "host/identify/levenberg_marquardt.hpp"

#include <gtest/gtest.h>

namespace flexor::identify {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const VectorXd kFree = VectorXd::Constant(2, std::numeric_limits<double>::infinity());

// y = b1 (1 - exp(-b2 x)): Misra1a and BoxBOD.
auto growth(VectorXd x, VectorXd y) {
  return [x, y](const VectorXd& b, MatrixXd* jacobian) -> VectorXd {
    const Eigen::ArrayXd left = (-b(1) * x.array()).exp();
    if (jacobian) {
      jacobian->resize(x.size(), 2);
      jacobian->col(0) = 1 - left;
      jacobian->col(1) = b(0) * x.array() * left;
    }
    return b(0) * (1 - left) - y.array();
  };
}

auto box_bod() {
  return growth(Eigen::Vector<double, 6>{1, 2, 3, 5, 7, 10},
                Eigen::Vector<double, 6>{109, 149, 149, 191, 213, 224});
}

TEST(LevenbergMarquardt, FindsCertifiedParametersFromCertifiedStarts) {
  const VectorXd x{
      {77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0}};
  const VectorXd y{
      {10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78}};
  for (VectorXd b : {VectorXd{{500, 0.0001}}, VectorXd{{250, 0.0005}}}) {
    const LmSummary s = levenberg_marquardt(growth(x, y), -kFree, kFree, {.cost_tolerance = 1e-14}, b);
    EXPECT_NEAR(b(0), 2.3894212918e+02, 1e-5);
    EXPECT_NEAR(b(1), 5.5015643181e-04, 1e-11);
    EXPECT_NEAR(2 * s.cost, 1.2455138894e-01, 1e-10);
  }
  VectorXd b{{100, 0.75}};
  (void)levenberg_marquardt(box_bod(), -kFree, kFree, {.cost_tolerance = 1e-14}, b);
  EXPECT_NEAR(b(0), 2.1380940889e+02, 1e-5);
  EXPECT_NEAR(b(1), 5.4723748542e-01, 1e-8);
}

TEST(LevenbergMarquardt, StopsAtABoundAndSaysWhatItCouldNotDo) {
  const VectorXd lower{{0, 0}};
  VectorXd b{{100, 0.2}};
  const LmSummary s = levenberg_marquardt(box_bod(), lower, VectorXd{{300, 0.4}}, {}, b);
  EXPECT_EQ(s.status, LmSummary::Status::converged);
  EXPECT_EQ(b(1), 0.4);
  b = VectorXd{{100, 0.75}};
  EXPECT_EQ(levenberg_marquardt(box_bod(), -kFree, kFree, {.max_iterations = 1}, b).status,
            LmSummary::Status::iteration_limit);
  b(1) = -1e6;
  EXPECT_EQ(levenberg_marquardt(box_bod(), -kFree, kFree, {}, b).status, LmSummary::Status::not_finite);
}

}  // namespace
}  // namespace flexor::identify
