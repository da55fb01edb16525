#include "host/identify/line_estimate.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <span>

namespace flexor::identify {
namespace {

constexpr double kTold = 0.6;  // of the prior's deviation; a gain that is known no better stays one
constexpr int kMostSteps = 30;
constexpr double kSettled = 1e-7;
constexpr double kMostLogGain = 1.5;
constexpr double kFreedom = 4;  // of the tails of a sensor's own shift

// Minus twice the logarithm of Student's density, as the square of a row's error; and what its slope is of the plain row's.
struct Tailed {
  double error;
  double slope;
};

Tailed tailed(double error) {
  if (std::abs(error) < 1e-6) return {error, 1};
  const double out = std::copysign(std::sqrt(kFreedom * std::log1p(error * error / kFreedom)), error);
  return {out, error / (1 + error * error / kFreedom) / out};
}

// Unknown are shift and logarithm of the gain of each sensor, what all shifts have in common, what the evidence adds.
struct LineSystem {
  const std::vector<Prior>& priors;
  std::span<const Evidence> evidence;

  Eigen::Index sensors() const { return column(priors.size()); }  // columns
};

std::vector<Line> lines_of(const Eigen::VectorXd& p, Eigen::Index sensors) {
  std::vector<Line> out;
  for (Eigen::Index i = 0; i < sensors; i += 2) out.push_back({p(i), p(i + 1)});
  return out;
}

// The common shift, in its standard deviations; of one sensor alone it is all of the shift's.
Rows prior_rows(const std::vector<Prior>& priors, const Eigen::VectorXd& p) {
  Rows out{Eigen::MatrixXd::Identity(p.size(), p.size()), -p};
  const Eigen::Index all = column(priors.size());
  for (Eigen::Index i = 0; i < all; i += 2) {
    const Prior& prior = priors[static_cast<std::size_t>(i / 2)];
    const double alike = priors.size() > 1 ? prior.alike : 0;
    const double common = prior.shift_sd * std::sqrt(alike);
    const double own_sd = prior.shift_sd * std::sqrt(1 - alike);
    const double off = (common * p(all) - p(i)) / own_sd;
    const Tailed row = priors.size() > 1 ? tailed(off) : Tailed{off, 1};
    out.error(i) = row.error;
    out.jacobian(i, i) = row.slope / own_sd;
    out.jacobian(i, all) = -row.slope * common / own_sd;
    out.error(i + 1) = -p(i + 1) / prior.log_gain_sd;
    out.jacobian(i + 1, i + 1) = 1 / prior.log_gain_sd;
  }
  return out;
}

// All rows, the prior's first.
Rows rows_at(const LineSystem& system, const Eigen::VectorXd& p) {
  const Eigen::Index sensors = system.sensors();
  Rows out = prior_rows(system.priors, p);
  Eigen::Index own = sensors + 1;
  for (const Evidence& one : system.evidence) {
    const Rows rows = one.rows(lines_of(p, sensors), p.segment(own, one.unknowns));
    const Eigen::Index n = rows.error.size();
    out.error.conservativeResize(out.error.size() + n);
    out.error.tail(n) = rows.error;
    out.jacobian.conservativeResizeLike(Eigen::MatrixXd::Zero(out.error.size(), p.size()));
    out.jacobian.bottomLeftCorner(n, sensors) = rows.jacobian.leftCols(sensors);
    out.jacobian.bottomRows(n).middleCols(own, one.unknowns) = rows.jacobian.rightCols(one.unknowns);
    own += one.unknowns;
  }
  return out;
}

// Gauss and Newton's steps, halved where they lead uphill. The gains of `fixed` stay.
Eigen::VectorXd minimised(const LineSystem& system, Eigen::VectorXd p,
                          const std::vector<Eigen::Index>& fixed = {}) {
  Rows now = rows_at(system, p);
  for (int i = 0; i < kMostSteps; ++i) {
    Eigen::MatrixXd jacobian = now.jacobian;
    for (const Eigen::Index c : fixed) jacobian.col(c).setZero();
    const Eigen::VectorXd step = jacobian.colPivHouseholderQr().solve(now.error);
    double share = 1;
    for (; share > 1e-3; share /= 2) {
      Eigen::VectorXd next = p + share * step;
      for (Eigen::Index c = 1; c < system.sensors(); c += 2)
        next(c) = std::clamp(next(c), -kMostLogGain, kMostLogGain);
      Rows there = rows_at(system, next);
      if (!(there.error.squaredNorm() <= now.error.squaredNorm())) continue;
      p = next;
      now = std::move(there);
      break;
    }
    if (share <= 1e-3 || step.norm() * share < kSettled) break;
  }
  return p;
}

Eigen::MatrixXd covariance_at(const LineSystem& system, const Eigen::VectorXd& p) {
  // Of full rank by the prior's rows.
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows_at(system, p).jacobian);
  const Eigen::MatrixXd upper = qr.matrixQR().topRows(p.size()).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd inverse =
      upper.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(p.size(), p.size()));
  return inverse * inverse.transpose();
}

}  // namespace

model::Correction correction_of(const Line& line, const model::Spread& made) {
  const double gain = std::exp(line.log_gain);
  return {gain, made.middle() * (1 - gain) + line.shift * made.span()};
}

LineEstimate estimate(const std::vector<Prior>& priors, const std::vector<Evidence>& evidence) {
  const LineSystem system{priors, evidence};
  Eigen::Index size = system.sensors() + 1;
  for (const Evidence& one : evidence) size += one.unknowns;
  Eigen::VectorXd p = Eigen::VectorXd::Zero(size);
  if (evidence.size() > 1) {
    // The last piece, a camera's where there is one, bends most: its steps start where the others lead.
    const Eigen::Index before = size - evidence.back().unknowns;
    p.head(before) =
        minimised({priors, system.evidence.first(evidence.size() - 1)}, Eigen::VectorXd::Zero(before));
  }
  p = minimised(system, p);
  LineEstimate out;
  out.covariance = covariance_at(system, p);
  std::vector<Eigen::Index> fixed;
  for (std::size_t i = 0; i < priors.size(); ++i) {
    const Eigen::Index at = column(i);
    const auto& c = out.covariance;
    FittedLine& fit =
        out.fit.emplace_back(FittedLine{{}, false, c(at, at), c(at + 1, at + 1), c(at, at + 1)});
    fit.gain_told = std::sqrt(fit.log_gain_variance) < kTold * priors[i].log_gain_sd;
    if (!fit.gain_told) fixed.push_back(at + 1);
  }
  for (const Eigen::Index gain : fixed) p(gain) = 0;
  if (!fixed.empty()) p = minimised(system, p, fixed);
  for (std::size_t i = 0; i < priors.size(); ++i) out.fit[i].line = {p(column(i)), p(column(i) + 1)};
  return out;
}

}  // namespace flexor::identify
