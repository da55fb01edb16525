#include "host/identify/fit.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace flexor::identify {
namespace {

constexpr double kRankTolerance = 1e-7;
constexpr Eigen::Index kMaxLags = 400;

// Lags until the residuals' autocorrelation first falls below 2 / sqrt(n).
int correlation_length(const Eigen::VectorXd& residual) {
  const auto n = residual.size();
  const Eigen::VectorXd r = residual.array() - residual.mean();
  const double variance = r.squaredNorm();
  if (!(variance > 0)) return 0;
  const double threshold = 2 / std::sqrt(static_cast<double>(n));
  const auto most = static_cast<int>(std::min<Eigen::Index>(n / 20, kMaxLags));
  for (int lag = 1; lag <= most; ++lag) {
    if (r.head(n - lag).dot(r.tail(n - lag)) / variance < threshold) return lag - 1;
  }
  return most;
}

}  // namespace

Uncertainty uncertainty(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian, double delta,
                        const Eigen::MatrixXd& prior) {
  const auto n = jacobian.rows();
  const auto p = jacobian.cols();
  Uncertainty result;

  // rho' (score) and rho'' (weight) of the pseudo-Huber loss; 1 and r for an infinite delta.
  const Eigen::ArrayXd z = 1 + (residual.array() / delta).square();
  const Eigen::ArrayXd score = residual.array() / z.sqrt();
  const Eigen::ArrayXd root_weight = z.pow(-0.75);

  Eigen::MatrixXd weighted(n + prior.rows(), p);
  weighted << (jacobian.array().colwise() * root_weight).matrix(), prior;
  const Eigen::VectorXd norms = weighted.colwise().norm();
  for (Eigen::Index i = 0; i < p; ++i) {
    if (!(norms(i) > 0)) result.undetermined.push_back(static_cast<int>(i));
  }
  if (!result.undetermined.empty()) return result;

  const Eigen::VectorXd scale = norms.cwiseInverse();
  const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::HouseholderQRPreconditioner> svd(
      weighted * scale.asDiagonal(), Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  result.condition = sigma(0) / std::max(sigma(p - 1), 1e-300);
  if (sigma(p - 1) < kRankTolerance * sigma(0)) {
    Eigen::Index worst = 0;
    svd.matrixV().col(p - 1).cwiseAbs().maxCoeff(&worst);
    result.undetermined.push_back(static_cast<int>(worst));
    return result;
  }
  const Eigen::MatrixXd inverse = scale.asDiagonal() * svd.matrixV() *
                                  sigma.array().square().inverse().matrix().asDiagonal() *
                                  svd.matrixV().transpose() * scale.asDiagonal();

  const Eigen::MatrixXd g = jacobian.array().colwise() * score;
  Eigen::MatrixXd s = g.transpose() * g;
  const int lags = correlation_length(residual);
  for (int lag = 1; lag <= lags; ++lag) {
    const double bartlett = 1 - static_cast<double>(lag) / (lags + 1);
    const Eigen::MatrixXd c = g.topRows(n - lag).transpose() * g.bottomRows(n - lag);
    s += bartlett * (c + c.transpose());
  }
  const double small_sample = static_cast<double>(n) / static_cast<double>(n - p);
  result.covariance = small_sample * inverse * s * inverse;
  return result;
}

}  // namespace flexor::identify
