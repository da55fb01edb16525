#include "host/model/discrete.hpp"

#include <cassert>
#include <unsupported/Eigen/MatrixFunctions>

namespace flexor::model {
namespace {

Eigen::MatrixXd chain_matrix(const Eigen::VectorXd& rates_rad_s) {
  Eigen::MatrixXd a = (-rates_rad_s).asDiagonal();
  a.diagonal(-1) = rates_rad_s.tail(rates_rad_s.size() - 1);
  return a;
}

}  // namespace

ZeroOrderHold zero_order_hold(const Eigen::VectorXd& rates_rad_s, double period_s) {
  assert(period_s > 0 && rates_rad_s.minCoeff() > 0);
  const Eigen::MatrixXd a = chain_matrix(rates_rad_s) * period_s;
  ZeroOrderHold hold;
  hold.transition = a.exp();
  hold.input = Eigen::VectorXd::Ones(a.rows()) - hold.transition.rowwise().sum();
  return hold;
}

Eigen::MatrixXd exp_derivative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& da) {
  const auto n = a.rows();
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = a;
  block.bottomRightCorner(n, n) = a;
  block.topRightCorner(n, n) = da;
  return Eigen::MatrixXd(block.exp()).topRightCorner(n, n);
}

ZeroOrderHold zero_order_hold_derivative(const Eigen::VectorXd& rates_rad_s, double period_s,
                                         Eigen::Index i) {
  const Eigen::MatrixXd a = chain_matrix(rates_rad_s) * period_s;
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(a.rows(), a.cols());
  change.row(i) = a.row(i);  // row i of A is proportional to a_i: d/d(log a_i) keeps that row
  ZeroOrderHold derivative;
  derivative.transition = exp_derivative(a, change);
  derivative.input = -derivative.transition.rowwise().sum();
  return derivative;
}

}  // namespace flexor::model
