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
#include <utility>
#include <vector>

namespace flexor::identify {

inline constexpr double kFirstLambda = 1e-3;

struct LmOptions {
  int max_iterations = 100;
  double cost_tolerance = 1e-7;  // relative decrease of a step
  double step_tolerance = 1e-8;  // of a step's length to that of x
};

struct LmSummary {
  enum class Status { converged, iteration_limit, not_finite };  // not_finite: at the start itself
  Status status = Status::iteration_limit;
  double cost = std::numeric_limits<double>::infinity();  // |r|^2 / 2
  int iterations = 0;
};

// Where the search stands: cost and Jacobian at x, and the orthogonal factors of the Jacobian's free columns.
struct LmPoint {
  Eigen::VectorXd r;
  Eigen::MatrixXd jacobian;
  std::vector<Eigen::Index> free;
  Eigen::MatrixXd upper;    // R
  Eigen::VectorXd rotated;  // Q'r
  double cost() const { return r.squaredNorm() / 2; }

  void factor(const Eigen::VectorXd& x, const Eigen::VectorXd& lower_bound,
              const Eigen::VectorXd& upper_bound) {
    const Eigen::VectorXd gradient = jacobian.transpose() * r;
    free.clear();
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const bool pushed =
          (x(i) <= lower_bound(i) && gradient(i) > 0) || (x(i) >= upper_bound(i) && gradient(i) < 0);
      if (!pushed) free.push_back(i);
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(Eigen::MatrixXd(jacobian(Eigen::all, free)));
    const Eigen::Index rows = std::min(std::ssize(free), jacobian.rows());
    upper = Eigen::MatrixXd(qr.matrixQR().topRows(rows)).triangularView<Eigen::Upper>();
    rotated = (qr.householderQ().transpose() * r).head(rows);
  }

  // x and the step, without regard to bounds.
  Eigen::VectorXd next(Eigen::VectorXd x, double lambda, const Eigen::VectorXd& scale) const {
    const Eigen::Index n = std::ssize(free);
    Eigen::MatrixXd damped(upper.rows() + n, n);
    damped << upper, Eigen::MatrixXd((std::sqrt(lambda) * scale(free)).asDiagonal());
    Eigen::VectorXd right = Eigen::VectorXd::Zero(damped.rows());
    right.head(upper.rows()) = -rotated;
    x(free) += damped.colPivHouseholderQr().solve(right);
    return x;
  }
};

// residual(x, jacobian) returns r and, unless it is null, fills in the Jacobian. `x` is the start and the result.
template <class Residual>
LmSummary levenberg_marquardt(const Residual& residual, const Eigen::VectorXd& lower,
                              const Eigen::VectorXd& upper, const LmOptions& options, Eigen::VectorXd& x) {
  constexpr double kHopeless = 1e16;  // a lambda at which no step is left
  x = x.cwiseMax(lower).cwiseMin(upper);
  LmPoint at;
  LmPoint tried;
  at.r = residual(x, &at.jacobian);
  if (!at.r.allFinite() || !at.jacobian.allFinite()) return {LmSummary::Status::not_finite};
  LmSummary out{LmSummary::Status::converged, at.cost(), 0};
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(x.size());
  double lambda = kFirstLambda;
  double factor = 2;
  for (bool moved = true; lambda < kHopeless; ++out.iterations) {
    if (out.iterations == options.max_iterations) {
      out.status = LmSummary::Status::iteration_limit;
      return out;
    }
    if (moved) {
      at.factor(x, lower, upper);
      scale = scale.cwiseMax(at.jacobian.colwise().norm().transpose()).cwiseMax(1e-12);
    }
    if (at.free.empty()) return out;
    const Eigen::VectorXd next = at.next(x, lambda, scale).cwiseMax(lower).cwiseMin(upper);
    const double promised = out.cost - (at.r + at.jacobian * (next - x)).squaredNorm() / 2;
    const bool still = (next - x).norm() <= options.step_tolerance * (x.norm() + options.step_tolerance);
    tried.r = residual(next, &tried.jacobian);
    const bool finite = tried.r.allFinite() && tried.jacobian.allFinite();
    const double decrease = finite ? out.cost - tried.cost() : -1;
    moved = decrease > 0 && promised > 0;
    if (!moved && still) return out;
    if (!moved) {
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
    std::swap(at.r, tried.r);
    std::swap(at.jacobian, tried.jacobian);
  }
  return out;
}

}  // namespace flexor::identify
