#include "host/donning/estimate.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace flexor::donning {
namespace {

constexpr double kTold = 0.6;  // of the prior's deviation; a gain that is known no better stays one
constexpr int kMostSteps = 30;
constexpr double kSettled = 1e-7;
constexpr double kMostLogGain = 1.5;

Eigen::Index column(std::size_t sensor) { return 2 * static_cast<Eigen::Index>(sensor); }

double made_of(const Line& line, const model::Spread& made, double reading) {
  return made.middle() + std::exp(line.log_gain) * (reading - made.middle()) + line.shift * made.span();
}

// Shift and logarithm of the gain, of what `reading` is taken for; in spans.
Eigen::RowVector2d derivative(const Line& line, const model::Spread& made, double reading) {
  return {1, std::exp(line.log_gain) * (reading - made.middle()) / made.span()};
}

struct Stacked {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd error;
};

class System {
 public:
  System(const std::vector<Prior>& priors, const std::vector<const Evidence*>& evidence)
      : priors_(priors), evidence_(evidence), sensors_(column(priors.size())), size_(sensors_) {
    for (const Evidence* one : evidence) size_ += one->unknowns();
  }

  Eigen::Index size() const { return size_; }
  Eigen::Index sensors() const { return sensors_; }  // columns

  static std::vector<Line> lines(const Eigen::VectorXd& p, std::size_t sensors) {
    std::vector<Line> out;
    for (std::size_t i = 0; i < sensors; ++i) out.push_back({p(column(i)), p(column(i) + 1)});
    return out;
  }

  // All rows, the prior's first.
  Stacked at(const Eigen::VectorXd& p) const {
    const std::vector<Line> now = lines(p, priors_.size());
    std::vector<Rows> all;
    Eigen::Index rows = size_;
    Eigen::Index own = sensors_;
    for (const Evidence* one : evidence_) {
      all.push_back(one->rows(now, p.segment(own, one->unknowns())));
      own += one->unknowns();
      rows += all.back().error.size();
    }
    Stacked out{Eigen::MatrixXd::Zero(rows, size_), Eigen::VectorXd::Zero(rows)};
    for (Eigen::Index i = 0; i < size_; ++i) {
      const double sd = deviation(i);
      out.jacobian(i, i) = 1 / sd;
      out.error(i) = -p(i) / sd;
    }
    Eigen::Index row = size_;
    own = sensors_;
    for (std::size_t e = 0; e < all.size(); ++e) {
      const Eigen::Index n = all[e].error.size();
      const Eigen::Index unknowns = evidence_[e]->unknowns();
      out.error.segment(row, n) = all[e].error;
      out.jacobian.block(row, 0, n, sensors_) = all[e].jacobian.leftCols(sensors_);
      out.jacobian.block(row, own, n, unknowns) = all[e].jacobian.rightCols(unknowns);
      row += n;
      own += unknowns;
    }
    return out;
  }

  double deviation(Eigen::Index i) const {
    if (i >= sensors_) return 1;
    const Prior& prior = priors_[static_cast<std::size_t>(i / 2)];
    return i % 2 == 0 ? prior.shift_sd : prior.log_gain_sd;
  }

 private:
  const std::vector<Prior>& priors_;
  const std::vector<const Evidence*>& evidence_;
  Eigen::Index sensors_;
  Eigen::Index size_;
};

// Gauss and Newton's steps, halved where they lead uphill. Columns that are not free stay.
Eigen::VectorXd minimised(const System& system, Eigen::VectorXd p, const std::vector<bool>& free) {
  Stacked now = system.at(p);
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
      Stacked there = system.at(next);
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

}  // namespace

model::Correction correction_of(const Line& line, const model::Spread& made) {
  const double gain = std::exp(line.log_gain);
  return {gain, made.middle() * (1 - gain) + line.shift * made.span()};
}

Rows Sightings::rows(const std::vector<Line>& lines, const Eigen::VectorXd&) const {
  const auto n = static_cast<Eigen::Index>(sightings_.size());
  Rows out{Eigen::MatrixXd::Zero(n, column(lines.size())), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sighting& s = sightings_[static_cast<std::size_t>(i)];
    const model::Spread& made = made_[s.sensor];
    out.error(i) = (s.made - made_of(lines[s.sensor], made, s.reading)) / (made.span() * s.error);
    out.jacobian.block<1, 2>(i, column(s.sensor)) = derivative(lines[s.sensor], made, s.reading) / s.error;
  }
  return out;
}

namespace {

constexpr double kTurnSd = 0.04;  // of one turn's reading, in spans, before any was seen
constexpr double kEndSd = 0.01;   // of a quantile there

// Of the mean of turns, in spans: what they scatter by, with kTurnSd for one more turn.
double turn_variance(const std::vector<double>& turns, double span) {
  const auto n = static_cast<double>(turns.size());
  double mean = 0;
  for (const double u : turns) mean += u / n;
  double squares = kTurnSd * kTurnSd;
  for (const double u : turns) squares += (u - mean) * (u - mean) / (span * span);
  return squares / std::max(1.0, n) / std::max(1.0, n);
}

}  // namespace

Quantiles::Quantiles(std::size_t sensor, Window window, model::Spread made, const Prior& prior)
    : sensor_(sensor), window_(std::move(window)), made_(std::move(made)) {
  const auto n = static_cast<Eigen::Index>(made_.reading.size());
  const double span = made_.span();
  Eigen::VectorXd place(n);  // about the middle, in spans
  for (Eigen::Index i = 0; i < n; ++i)
    place(i) = (made_.reading[static_cast<std::size_t>(i)] - made_.middle()) / span;
  const Eigen::VectorXd low = 0.5 - place.array();
  const Eigen::VectorXd high = 0.5 + place.array();
  const double lacking = std::max(0.0, 1 - window_.span() / span - prior.log_gain_sd);
  const double common = prior.motion_sd * prior.motion_sd + lacking * lacking / 4;
  const double reach = prior.reach_sd * prior.reach_sd + lacking * lacking;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(n, n, common) + reach * place * place.transpose();
  covariance += turn_variance(window_.turns.low, span) * low * low.transpose();
  covariance += turn_variance(window_.turns.high, span) * high * high.transpose();
  covariance.diagonal().array() += kEndSd * kEndSd;
  covariance.diagonal().segment(1, n - 2).array() += prior.density_sd * prior.density_sd;
  whitening_ = covariance.llt().matrixL();
}

Rows Quantiles::rows(const std::vector<Line>& lines, const Eigen::VectorXd&) const {
  const auto n = static_cast<Eigen::Index>(made_.reading.size());
  Rows out{Eigen::MatrixXd::Zero(n, column(lines.size())), Eigen::VectorXd(n)};
  const Line& line = lines[sensor_];
  for (Eigen::Index i = 0; i < n; ++i) {
    const double reading = window_.quantile[static_cast<std::size_t>(i)];
    out.error(i) =
        (made_.reading[static_cast<std::size_t>(i)] - made_of(line, made_, reading)) / made_.span();
    out.jacobian.block<1, 2>(i, column(sensor_)) = derivative(line, made_, reading);
  }
  const auto lower = whitening_.triangularView<Eigen::Lower>();
  out.error = lower.solve(out.error);
  out.jacobian = lower.solve(out.jacobian);
  return out;
}

Estimate estimate(const std::vector<Prior>& priors, const std::vector<const Evidence*>& evidence) {
  const System system(priors, evidence);
  std::vector<bool> free(static_cast<std::size_t>(system.size()), true);
  Eigen::VectorXd p = minimised(system, Eigen::VectorXd::Zero(system.size()), free);
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
  out.line = System::lines(p, priors.size());
  return out;
}

}  // namespace flexor::donning
