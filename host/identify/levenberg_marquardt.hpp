// Nonlinear least squares within bounds: min_x |r(x)|^2 / 2, lower <= x <= upper.
//
//   (J'J + lambda D^2) p = -J'r,   D the largest column norms of J so far,   x <- what of x + p lies within the bounds
//
// solved by the orthogonal factors of J, once for each J, then of [R; sqrt(lambda) D]. Parameters at a bound that the gradient
// pushes against stay there for the step. lambda follows the ratio of the decrease to what the linear problem promises.
// Sources: J. More, Lecture Notes in Mathematics 630 (1978) 105 (scaling); H. Nielsen, Damping parameter in Marquardt's method,
// IMM-REP-1999-05 (lambda); C. Kanzow, N. Yamashita, M. Fukushima, J. Comput. Appl. Math. 172 (2004) 375 (projected steps).
#pragma once

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace flexor::identify {

struct LmOptions {
  int max_iterations = 100;
  double cost_tolerance = 1e-7;  // relative decrease of a step
  double step_tolerance = 1e-8;  // of a step's length to that of x
  double first_lambda = 1e-3;
};

struct LmSummary {
  enum class Status { converged, iteration_limit, not_finite };  // not_finite: at the start itself
  Status status = Status::iteration_limit;
  double cost = std::numeric_limits<double>::infinity();  // |r|^2 / 2
  int iterations = 0;
};

// residual(x, jacobian) returns r and, unless it is null, fills in the Jacobian. `x` is the start and the result.
template <class Residual>
LmSummary levenberg_marquardt(const Residual& residual, const Eigen::VectorXd& lower,
                              const Eigen::VectorXd& upper, const LmOptions& options, Eigen::VectorXd& x) {
  using Eigen::Index;
  using Eigen::MatrixXd;
  using Eigen::VectorXd;
  constexpr double kHopeless = 1e16;  // a lambda at which no step is left
  LmSummary out;
  x = x.cwiseMax(lower).cwiseMin(upper);
  MatrixXd jacobian;
  MatrixXd jacobian_tried;
  VectorXd r = residual(x, &jacobian);
  if (!r.allFinite() || !jacobian.allFinite()) {
    out.status = LmSummary::Status::not_finite;
    return out;
  }
  out.cost = r.squaredNorm() / 2;
  VectorXd scale = VectorXd::Zero(x.size());
  double lambda = options.first_lambda;
  double factor = 2;
  out.status = LmSummary::Status::converged;
  while (true) {
    scale = scale.cwiseMax(jacobian.colwise().norm().transpose()).cwiseMax(1e-12);
    const VectorXd gradient = jacobian.transpose() * r;
    std::vector<Index> free;
    for (Index i = 0; i < x.size(); ++i) {
      const bool pushed = (x(i) <= lower(i) && gradient(i) > 0) || (x(i) >= upper(i) && gradient(i) < 0);
      if (!pushed) free.push_back(i);
    }
    if (free.empty()) return out;
    const Index n = std::ssize(free);
    const Eigen::HouseholderQR<MatrixXd> qr(MatrixXd(jacobian(Eigen::all, free)));
    const Index rows = std::min(n, jacobian.rows());
    const MatrixXd factor_r = MatrixXd(qr.matrixQR().topRows(rows)).template triangularView<Eigen::Upper>();
    const VectorXd rotated = (qr.householderQ().transpose() * r).head(rows);
    while (true) {
      if (out.iterations == options.max_iterations) {
        out.status = LmSummary::Status::iteration_limit;
        return out;
      }
      if (!(lambda < kHopeless)) return out;
      ++out.iterations;
      MatrixXd damped(rows + n, n);
      damped << factor_r, MatrixXd((std::sqrt(lambda) * scale(free)).asDiagonal());
      VectorXd right = VectorXd::Zero(rows + n);
      right.head(rows) = -rotated;
      VectorXd next = x;
      next(free) += damped.colPivHouseholderQr().solve(right);
      next = next.cwiseMax(lower).cwiseMin(upper);
      const VectorXd step = next - x;
      const double promised = out.cost - (r + jacobian * step).squaredNorm() / 2;
      const bool still = step.norm() <= options.step_tolerance * (x.norm() + options.step_tolerance);
      VectorXd tried = residual(next, nullptr);
      const double decrease = tried.allFinite() ? out.cost - tried.squaredNorm() / 2 : -1;
      bool better = decrease > 0 && promised > 0;
      if (better && !still) {
        tried = residual(next, &jacobian_tried);
        better = jacobian_tried.allFinite();
      }
      if (!better) {
        if (still) return out;
        lambda *= factor;
        factor *= 2;
        continue;
      }
      const double ratio = 2 * decrease / promised - 1;
      lambda *= std::max(1.0 / 3, 1 - ratio * ratio * ratio);
      factor = 2;
      x = next;
      const bool done = still || decrease <= options.cost_tolerance * out.cost;
      out.cost -= decrease;
      if (done) return out;
      r = std::move(tried);
      jacobian.swap(jacobian_tried);
      break;
    }
  }
}

}  // namespace flexor::identify
