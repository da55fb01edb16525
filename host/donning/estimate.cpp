#include "host/donning/estimate.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <span>

namespace flexor::donning {
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

// Unknown: shift and logarithm of the gain of each sensor, what all shifts have in common, what the evidence adds.
class System {
 public:
  System(const std::vector<Prior>& priors, std::span<const Evidence> evidence)
      : priors_(priors), evidence_(evidence), sensors_(column(priors.size())), size_(sensors_ + 1) {
    for (const Evidence& one : evidence) size_ += one.unknowns;
  }

  Eigen::Index size() const { return size_; }
  Eigen::Index sensors() const { return sensors_; }  // columns

  std::vector<Line> lines(const Eigen::VectorXd& p) const {
    std::vector<Line> out;
    for (Eigen::Index i = 0; i < sensors_; i += 2) out.push_back({p(i), p(i + 1)});
    return out;
  }

  // All rows, the prior's first.
  Rows at(const Eigen::VectorXd& p) const {
    Rows out = prior_rows(p);
    Eigen::Index own = sensors_ + 1;
    for (const Evidence& one : evidence_) {
      const Rows rows = one.rows(lines(p), p.segment(own, one.unknowns));
      const Eigen::Index n = rows.error.size();
      out.error.conservativeResize(out.error.size() + n);
      out.error.tail(n) = rows.error;
      out.jacobian.conservativeResizeLike(Eigen::MatrixXd::Zero(out.error.size(), size_));
      out.jacobian.bottomLeftCorner(n, sensors_) = rows.jacobian.leftCols(sensors_);
      out.jacobian.bottomRows(n).middleCols(own, one.unknowns) = rows.jacobian.rightCols(one.unknowns);
      own += one.unknowns;
    }
    return out;
  }

 private:
  // The common shift, in its standard deviations; of one sensor alone it is all of the shift's.
  Rows prior_rows(const Eigen::VectorXd& p) const {
    Rows out{Eigen::MatrixXd::Identity(size_, size_), -p};
    for (std::size_t s = 0; s < priors_.size(); ++s) {
      const Prior& prior = priors_[s];
      const Eigen::Index i = column(s);
      const double alike = priors_.size() > 1 ? prior.alike : 0;
      const double common = prior.shift_sd * std::sqrt(alike);
      const double own_sd = prior.shift_sd * std::sqrt(1 - alike);
      const double off = (common * p(sensors_) - p(i)) / own_sd;
      const Tailed row = priors_.size() > 1 ? tailed(off) : Tailed{off, 1};
      out.error(i) = row.error;
      out.jacobian(i, i) = row.slope / own_sd;
      out.jacobian(i, sensors_) = -row.slope * common / own_sd;
      out.error(i + 1) = -p(i + 1) / prior.log_gain_sd;
      out.jacobian(i + 1, i + 1) = 1 / prior.log_gain_sd;
    }
    return out;
  }

  const std::vector<Prior>& priors_;
  std::span<const Evidence> evidence_;
  Eigen::Index sensors_;
  Eigen::Index size_;
};

// Gauss and Newton's steps, halved where they lead uphill. Columns that are not free stay.
Eigen::VectorXd minimised(const System& system, Eigen::VectorXd p, const std::vector<bool>& free) {
  Rows now = system.at(p);
  for (int i = 0; i < kMostSteps; ++i) {
    Eigen::MatrixXd jacobian = now.jacobian;
    for (Eigen::Index c = 0; c < p.size(); ++c) {
      if (!free[static_cast<std::size_t>(c)]) jacobian.col(c).setZero();
    }
    const Eigen::VectorXd step = jacobian.colPivHouseholderQr().solve(now.error);
    double share = 1;
    for (; share > 1e-3; share /= 2) {
      Eigen::VectorXd next = p + share * step;
      for (Eigen::Index c = 1; c < system.sensors(); c += 2)
        next(c) = std::clamp(next(c), -kMostLogGain, kMostLogGain);
      Rows there = system.at(next);
      if (!(there.error.squaredNorm() <= now.error.squaredNorm())) continue;
      p = next;
      now = std::move(there);
      break;
    }
    if (share <= 1e-3 || step.norm() * share < kSettled) break;
  }
  return p;
}

Eigen::MatrixXd covariance_at(const System& system, const Eigen::VectorXd& p) {
  const Eigen::MatrixXd jacobian = system.at(p).jacobian;  // of full rank by the prior's rows
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(jacobian);
  const Eigen::MatrixXd upper = qr.matrixQR().topRows(p.size()).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd inverse =
      upper.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(p.size(), p.size()));
  return inverse * inverse.transpose();
}

// The last piece, a camera's where there is one, bends most: its steps start where the others lead.
Eigen::VectorXd start_of(const std::vector<Prior>& priors, std::span<const Evidence> evidence,
                         Eigen::Index size) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(size);
  if (evidence.size() < 2) return out;
  const System fewer(priors, evidence.first(evidence.size() - 1));
  const std::vector<bool> all(static_cast<std::size_t>(fewer.size()), true);
  out.head(fewer.size()) = minimised(fewer, Eigen::VectorXd::Zero(fewer.size()), all);
  return out;
}

}  // namespace

model::Correction correction_of(const Line& line, const model::Spread& made) {
  const double gain = std::exp(line.log_gain);
  return {gain, made.middle() * (1 - gain) + line.shift * made.span()};
}

Estimate estimate(const std::vector<Prior>& priors, const std::vector<Evidence>& evidence) {
  const System system(priors, evidence);
  std::vector<bool> free(static_cast<std::size_t>(system.size()), true);
  Eigen::VectorXd p = minimised(system, start_of(priors, evidence, system.size()), free);
  Estimate out;
  out.covariance = covariance_at(system, p);
  bool all_told = true;
  for (std::size_t i = 0; i < priors.size(); ++i) {
    const Eigen::Index at = column(i) + 1;
    const bool told = std::sqrt(out.covariance(at, at)) < kTold * priors[i].log_gain_sd;
    out.gain_told.push_back(told);
    if (told) continue;
    free[static_cast<std::size_t>(at)] = false;
    p(at) = 0;
    all_told = false;
  }
  if (!all_told) p = minimised(system, p, free);
  out.line = system.lines(p);
  return out;
}

}  // namespace flexor::donning
