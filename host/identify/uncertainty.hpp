// Covariance of fitted parameters. Internal to this room.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace flexor::identify {

// Rows: the used samples in order of time. `residual` r_k, `jacobian` d(predicted)/d(theta) of the free
// parameters. delta: of the pseudo-Huber loss; infinite for plain least squares. `prior`: rows of the parameters that the fit holds near zero
// beside them, or none.
struct Uncertainty {
  Eigen::MatrixXd covariance;
  double condition = 0;
  // Free parameters, by column, that the data cannot tell: a column of zeros, or the largest part of a
  // direction whose singular value is below 1e-7 of the largest. The covariance is meaningless while there
  // are any.
  std::vector<int> undetermined;
};

Uncertainty uncertainty(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian, double delta,
                        const Eigen::MatrixXd& prior);

}  // namespace flexor::identify
