// Nonlinear least squares within bounds: min_x |r(x)|^2 / 2, lower <= x <= upper.
//
//   (J'J + lambda D^2) p = -J'r,   D the largest column norms of J so far,   x <- what of x + p lies within the bounds
//
// by Cholesky's factors, the diagonal made one: what rounding adds to a step, the next one takes out. Parameters at a bound that the
// gradient pushes against stay there for the step. lambda follows the ratio of the decrease to what the linear problem promises.
// Sources: J. More, Lecture Notes in Mathematics 630 (1978) 105 (scaling); H. Nielsen, Damping parameter in Marquardt's method,
// IMM-REP-1999-05 (lambda); C. Kanzow, N. Yamashita, M. Fukushima, J. Comput. Appl. Math. 172 (2004) 375 (projected steps).
#pragma once

#include <Eigen/Cholesky>
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

// Where the search stands: |r|^2 / 2, J'J (its lower half) and J'r.
struct LmPoint {
  double cost = 0;
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;

  template <class Residual, class Jacobian>
  LmPoint(const Residual& residual, const Eigen::VectorXd& x, Jacobian& jacobian) {
    const Eigen::VectorXd r = residual(x, &jacobian);
    cost = r.squaredNorm() / 2;
    gradient = jacobian.transpose() * r;
    normal.setZero(x.size(), x.size());
    normal.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
  }
  bool is_finite() const { return std::isfinite(cost) && gradient.allFinite() && normal.allFinite(); }

  std::vector<Eigen::Index> free(const Eigen::VectorXd& x, const Eigen::VectorXd& lower,
                                 const Eigen::VectorXd& upper) const {
    std::vector<Eigen::Index> out;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const bool pushed = (x(i) <= lower(i) && gradient(i) > 0) || (x(i) >= upper(i) && gradient(i) < 0);
      if (!pushed) out.push_back(i);
    }
    return out;
  }

  // x and the step of the free parameters, without regard to bounds; `damping`: of the diagonal.
  Eigen::VectorXd next(Eigen::VectorXd x, const std::vector<Eigen::Index>& free,
                       const Eigen::VectorXd& damping) const {
    Eigen::MatrixXd damped = normal(free, free);
    damped.diagonal() += damping(free);
    const Eigen::VectorXd scale = damped.diagonal().cwiseSqrt().cwiseInverse();
    damped = scale.asDiagonal() * damped * scale.asDiagonal();
    x(free) -= scale.cwiseProduct(damped.ldlt().solve(scale.cwiseProduct(gradient(free))));
    return x;
  }
};

// residual(x, jacobian) returns r and, unless it is null, fills in the Jacobian. `x` is the start and the result.
template <class Jacobian = Eigen::MatrixXd, class Residual>
LmSummary levenberg_marquardt(const Residual& residual, const Eigen::VectorXd& lower,
                              const Eigen::VectorXd& upper, const LmOptions& options, Eigen::VectorXd& x) {
  constexpr double kHopeless = 1e16;  // a lambda at which no step is left
  x = x.cwiseMax(lower).cwiseMin(upper);
  Jacobian jacobian;
  LmPoint at(residual, x, jacobian);
  if (!at.is_finite()) return {LmSummary::Status::not_finite};
  LmSummary out{LmSummary::Status::converged, at.cost, 0};
  Eigen::VectorXd scale = Eigen::VectorXd::Constant(x.size(), 1e-24);
  double lambda = kFirstLambda;
  double factor = 2;
  for (; lambda < kHopeless; ++out.iterations) {
    if (out.iterations == options.max_iterations) {
      out.status = LmSummary::Status::iteration_limit;
      return out;
    }
    scale = scale.cwiseMax(at.normal.diagonal());
    const std::vector<Eigen::Index> free = at.free(x, lower, upper);
    if (free.empty()) return out;
    const Eigen::VectorXd next = at.next(x, free, lambda * scale).cwiseMax(lower).cwiseMin(upper);
    const Eigen::VectorXd step = next - x;
    const double promised = -step.dot(at.gradient + at.normal.selfadjointView<Eigen::Lower>() * step / 2);
    const bool still = step.norm() <= options.step_tolerance * (x.norm() + options.step_tolerance);
    LmPoint tried(residual, next, jacobian);
    const double decrease = tried.is_finite() ? at.cost - tried.cost : -1;
    if (!(decrease > 0 && promised > 0)) {
      if (still) return out;
      lambda *= factor;
      factor *= 2;
      continue;
    }
    const double ratio = 2 * decrease / promised - 1;
    lambda *= std::max(1.0 / 3, 1 - ratio * ratio * ratio);
    factor = 2;
    x = next;
    at = std::move(tried);
    out.cost = at.cost;
    if (still || decrease <= options.cost_tolerance * (at.cost + decrease)) return out;
  }
  return out;
}

}  // namespace flexor::identify
