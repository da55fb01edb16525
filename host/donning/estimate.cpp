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
constexpr double kFreedom = 4;  // of the tails of a sensor's own shift

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
  System(const std::vector<Prior>& priors, const std::vector<const Evidence*>& evidence)
      : priors_(priors), evidence_(evidence), sensors_(column(priors.size())), size_(sensors_ + 1) {
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
    Eigen::Index own = sensors_ + 1;
    for (const Evidence* one : evidence_) {
      all.push_back(one->rows(now, p.segment(own, one->unknowns())));
      own += one->unknowns();
      rows += all.back().error.size();
    }
    Stacked out{Eigen::MatrixXd::Zero(rows, size_), Eigen::VectorXd::Zero(rows)};
    add_prior(p, out);
    Eigen::Index row = size_;
    own = sensors_ + 1;
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

 private:
  // The common shift, in its standard deviations; of one sensor alone it is all of the shift's.
  void add_prior(const Eigen::VectorXd& p, Stacked& out) const {
    for (Eigen::Index i = sensors_; i < size_; ++i) {
      out.jacobian(i, i) = 1;
      out.error(i) = -p(i);
    }
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
  }

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

namespace {

// Standard deviations of where a pose lies, of the way from the open hand to the fist.
constexpr double kOpenBent = 0.06;
constexpr double kOpenBeyond = 0.02;
constexpr double kFistShort = 0.3;
constexpr double kFistBeyond = 0.02;

struct Place {
  double at;
  double slope;
};

// Of an unknown of unit variance: straight lines of either slope far from 0, smooth between them.
Place sided(double x, double below, double above) {
  const double root = std::hypot(x, 1.0);
  return {(above + below) / 2 * x + (above - below) / 2 * (root - 1),
          (above + below) / 2 + (above - below) / 2 * x / root};
}

}  // namespace

Rows Sightings::rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const {
  const auto n = static_cast<Eigen::Index>(sightings_.size());
  const Eigen::Index sensors = column(lines.size());
  Rows out{Eigen::MatrixXd::Zero(n, sensors + 2), Eigen::VectorXd(n)};
  const Place open = sided(own(0), kOpenBeyond, kOpenBent);
  const Place fist = sided(own(1), kFistShort, kFistBeyond);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sighting& s = sightings_[static_cast<std::size_t>(i)];
    const model::Spread& made = made_[s.sensor];
    const Place& place = s.fist ? fist : open;
    const double off = (s.made - made_of(lines[s.sensor], made, s.reading)) / made.span();
    out.error(i) = (off + s.pose * place.at) / s.error;
    out.jacobian.block<1, 2>(i, column(s.sensor)) = derivative(lines[s.sensor], made, s.reading) / s.error;
    out.jacobian(i, sensors + (s.fist ? 1 : 0)) = -s.pose * place.slope / s.error;
  }
  return out;
}

namespace {

constexpr double kTurnSd = 0.04;        // of one turn's reading, in spans, before any was seen
constexpr double kEndSd = 0.01;         // of a quantile there
constexpr double kDiffers = 0.5;        // of what the span differs by: where the middle may lie
constexpr double kDiffersAtFist = 0.3;  // the same where the open hand repeats
constexpr double kDiffersWhole = 0.4;   // of either, where every way goes from end to end
constexpr double kSameEnd = 0.15;       // of the stretch's reach: turns that are nearer are at one end
constexpr double kRepeats = 0.015;      // of the span: what its readings scatter by then
constexpr double kSameMotion = 0.6;     // of the variance of where a motion lies: all fingers together

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

namespace {

// From 0 to 1: how surely the open end is where the hand is straight. Straight fingers can go no farther, a fist is as
// tight as the wearer likes: where the open end comes back to one reading, what differs in reach differs at the fist.
double open_repeats(const Stretch& s) {
  if (s.bends == 0) return 0;
  const std::vector<double>& ends = s.bends > 0 ? s.window.turns.low_ends : s.window.turns.high_ends;
  const auto n = static_cast<double>(ends.size());
  if (n < 2) return 0;
  double mean = 0;
  for (const double u : ends) mean += u / n;
  double variance = 0;
  for (const double u : ends) variance += (u - mean) * (u - mean) / (n - 1);
  return 1 / (1 + variance / std::pow(kRepeats * s.made.span(), 2));
}

// Each end twice or more, and no turn between: where a hand does nothing but open and close, its ends are the finger's.
bool from_end_to_end(const Turns& turns) {
  if (turns.low_ends.size() < 2 || turns.high_ends.size() < 2) return false;
  const auto [lowest, highest_low] = std::ranges::minmax(turns.low_ends);
  const auto [lowest_high, highest] = std::ranges::minmax(turns.high_ends);
  const double same = kSameEnd * (highest - lowest);
  return highest_low - lowest < same && highest - lowest_high < same;
}

Eigen::MatrixXd covariance_of(const Stretch& s) {
  const auto n = static_cast<Eigen::Index>(s.made.reading.size());
  const double span = s.made.span();
  Eigen::VectorXd place(n);  // about the middle, in spans
  for (Eigen::Index i = 0; i < n; ++i)
    place(i) = (s.made.reading[static_cast<std::size_t>(i)] - s.made.middle()) / span;
  const Eigen::VectorXd low = 0.5 - place.array();
  const Eigen::VectorXd high = 0.5 + place.array();
  const double differs = std::log(s.window.span() / span);
  const double lacking = std::max(0.0, 1 - s.window.span() / span - s.prior.log_gain_sd);
  const double repeats = open_repeats(s);
  const double whole = from_end_to_end(s.window.turns) ? kDiffersWhole : 1;
  const double differs_sd = std::abs(differs) * whole * (kDiffers + repeats * (kDiffersAtFist - kDiffers));
  const double common = (1 - kSameMotion) * s.prior.motion_sd * s.prior.motion_sd + differs_sd * differs_sd;
  const double reach = s.prior.reach_sd * s.prior.reach_sd + lacking * lacking;
  const Eigen::VectorXd from_stay = place.array() + s.bends * 0.5 * repeats;
  Eigen::MatrixXd out = Eigen::MatrixXd::Constant(n, n, common) + reach * from_stay * from_stay.transpose();
  out += turn_variance(s.window.turns.low, span) * low * low.transpose();
  out += turn_variance(s.window.turns.high, span) * high * high.transpose();
  out.diagonal().array() += kEndSd * kEndSd;
  out.diagonal().segment(1, n - 2).array() += s.prior.density_sd * s.prior.density_sd;
  return out;
}

}  // namespace

Quantiles::Quantiles(std::vector<Stretch> stretches) : stretches_(std::move(stretches)) {
  for (const Stretch& one : stretches_) whitening_.emplace_back(covariance_of(one).llt().matrixL());
}

Rows Quantiles::rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const {
  Eigen::Index rows = 0;
  for (const Stretch& one : stretches_) rows += std::ssize(one.made.reading);
  Rows out{Eigen::MatrixXd::Zero(rows, column(lines.size()) + 1), Eigen::VectorXd(rows)};
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < stretches_.size(); ++k) {
    const Stretch& one = stretches_[k];
    const Line& line = lines[one.sensor];
    const auto n = static_cast<Eigen::Index>(one.made.reading.size());
    auto error = out.error.segment(row, n);
    auto jacobian = out.jacobian.middleRows(row, n);
    const double motion = one.prior.motion_sd * std::sqrt(kSameMotion);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double reading = one.window.quantile[static_cast<std::size_t>(i)];
      const double made = one.made.reading[static_cast<std::size_t>(i)];
      error(i) = (made - made_of(line, one.made, reading)) / one.made.span() - motion * own(0);
      jacobian.block<1, 2>(i, column(one.sensor)) = derivative(line, one.made, reading);
    }
    jacobian.rightCols(1).setConstant(motion);
    const auto lower = whitening_[k].triangularView<Eigen::Lower>();
    lower.solveInPlace(error);
    lower.solveInPlace(jacobian);
    row += n;
  }
  return out;
}

namespace {

// The last piece, a camera's where there is one, bends most: its steps start where the others lead.
Eigen::VectorXd start_of(const std::vector<Prior>& priors, std::vector<const Evidence*> evidence,
                         Eigen::Index size) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(size);
  if (evidence.size() < 2) return out;
  evidence.pop_back();
  const System fewer(priors, evidence);
  const std::vector<bool> all(static_cast<std::size_t>(fewer.size()), true);
  out.head(fewer.size()) = minimised(fewer, Eigen::VectorXd::Zero(fewer.size()), all);
  return out;
}

}  // namespace

Estimate estimate(const std::vector<Prior>& priors, const std::vector<const Evidence*>& evidence) {
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
  out.line = System::lines(p, priors.size());
  return out;
}

}  // namespace flexor::donning
