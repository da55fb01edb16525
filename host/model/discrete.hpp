// Exact zero-order hold of the LTI block.
#pragma once

#include <Eigen/Core>

namespace flexor::model {

// Unit-DC states of the chain of lags: x[k+1] = transition x[k] + input w[k], with
// transition (n x n, lower triangular) = exp(A T) and input_i = 1 - sum_j transition_ij.
struct ZeroOrderHold {
  Eigen::MatrixXd transition;
  Eigen::VectorXd input;
};

// Of x_1' = a_1 (w - x_1), x_i' = a_i (x_{i-1} - x_i); rates_rad_s are the a_i > 0, 1 to 3 of them. period_s > 0.
ZeroOrderHold zero_order_hold(const Eigen::VectorXd& rates_rad_s, double period_s);

// d exp(a + h da)/dh at h = 0: exp([a da; 0 a]) = [exp(a) L; 0 exp(a)], of which L.
// Source: N. Higham, Functions of Matrices (2008), theorem 3.6.
Eigen::MatrixXd exp_derivative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& da);

// d(hold)/d(log a_i).
ZeroOrderHold zero_order_hold_derivative(const Eigen::VectorXd& rates_rad_s, double period_s, Eigen::Index i);

}  // namespace flexor::model
