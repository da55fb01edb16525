#include "host/identify/line_estimate.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>

#include "host/identify/levenberg_marquardt.hpp"
#include "host/identify/robust.hpp"
#include "host/model/compensator.hpp"

namespace flexor::identify {
namespace {

constexpr double kDetermined = 0.6;  // of the prior's deviation; a gain that is known no better stays one
constexpr double kMostLogGain = 1.5;
constexpr double kFreedom = 4;  // of the tails of a sensor's own shift

// Standard deviations of where a pose lies, of the way from the open hand to the fist.
constexpr double kOpenBent = 0.06;
constexpr double kOpenBeyond = 0.02;
constexpr double kFistShort = 0.3;
constexpr double kFistBeyond = 0.02;

constexpr double kPose_deg = 5;         // of a finger in a pose
constexpr double kMostPoseError = 0.3;  // of the span, where the joint hardly moves

constexpr double kTurnSd = 0.04;        // of one turn's reading, in spans, before any was seen
constexpr double kEndSd = 0.01;         // of a quantile there
constexpr double kDiffers = 0.5;        // of what the span differs by: where the middle may lie
constexpr double kDiffersAtFist = 0.3;  // the same where the open hand repeats
constexpr double kDiffersWhole = 0.4;   // of either, where every way goes from end to end
constexpr double kSameEnd = 0.15;       // of the stretch's reach: turns that are nearer are at one end
constexpr double kRepeats = 0.015;      // of the span: what its readings scatter by then
constexpr double kSameMotion = 0.6;     // of the variance of where a motion lies: all fingers together

constexpr double kLeastModelError_deg = 2;
constexpr double kUnknownError_deg = 5;  // of a model that does not say
constexpr double kMarks_deg = 3;
constexpr double kNews_s = 1;
constexpr double kHuber = 2;    // standard deviations
constexpr double kStep = 1e-5;  // of slopes by differences

double made_of(const Line& line, const model::Spread& made, double reading) {
  return made.middle() + std::exp(line.log_gain) * (reading - made.middle()) + line.shift * made.span();
}

// Of an unknown of unit variance: straight lines of either slope far from 0, smooth between them.
double sided(double x, double below, double above) {
  return (above + below) / 2 * x + (above - below) / 2 * (std::hypot(x, 1.0) - 1);
}

// Of the mean of turns, in spans: what they scatter by, with kTurnSd for one more turn.
double turn_variance(const std::vector<double>& turns, double span) {
  const double n = std::max(1.0, static_cast<double>(turns.size()));
  return add_squares(kTurnSd * kTurnSd, turns, span * span) / n / n;
}

// From 0 to 1: how surely the open end is where the hand is straight. Straight fingers can go no farther, a fist is as
// tight as the wearer likes: where the open end comes back to one reading, what differs in reach differs at the fist.
double open_repeats(const Case& s, const Turns& turns) {
  const std::vector<double>& ends = s.reach.most_deg > 0 ? turns.low_ends : turns.high_ends;
  const auto n = static_cast<double>(ends.size());
  if (n < 2) return 0;
  const double variance = add_squares(0, ends, n - 1);
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

Eigen::MatrixXd covariance_of(const Case& s, const Window& window) {
  const auto n = static_cast<Eigen::Index>(s.made.reading.size());
  const double span = s.made.span();
  Eigen::VectorXd place(n);  // about the middle, in spans
  for (Eigen::Index i = 0; i < n; ++i)
    place(i) = (s.made.reading[static_cast<std::size_t>(i)] - s.made.middle()) / span;
  const Eigen::VectorXd low = 0.5 - place.array();
  const Eigen::VectorXd high = 0.5 + place.array();
  const double differs = std::log(window.span() / span);
  const double lacking = std::max(0.0, 1 - window.span() / span - s.prior.log_gain_sd);
  const double repeats = open_repeats(s, window.turns);
  const double whole = from_end_to_end(window.turns) ? kDiffersWhole : 1;
  const double differs_sd = std::abs(differs) * whole * (kDiffers + repeats * (kDiffersAtFist - kDiffers));
  const double common = (1 - kSameMotion) * s.prior.motion_sd * s.prior.motion_sd + differs_sd * differs_sd;
  const double reach = s.prior.reach_sd * s.prior.reach_sd + lacking * lacking;
  const Eigen::VectorXd from_stay = place.array() + std::copysign(0.5, s.reach.most_deg) * repeats;
  Eigen::MatrixXd out = Eigen::MatrixXd::Constant(n, n, common) + reach * from_stay * from_stay.transpose();
  out += turn_variance(window.turns.low, span) * low * low.transpose();
  out += turn_variance(window.turns.high, span) * high * high.transpose();
  out.diagonal().array() += kEndSd * kEndSd;
  out.diagonal().segment(1, n - 2).array() += s.prior.density_sd * s.prior.density_sd;
  return out;
}

double error_of(const model::Joint& joint) {
  return joint.accuracy ? std::max(kLeastModelError_deg, joint.accuracy->root_mean_square())
                        : kUnknownError_deg;
}

// Angles of the seen joints, each over the grid.
std::vector<std::vector<double>> angles_by(const std::vector<Line>& lines, const model::Model& model,
                                           const Seen& seen) {
  std::vector<model::Correction> correction;
  for (std::size_t i = 0; i < lines.size(); ++i)
    correction.push_back(correction_of(lines[i], *model.inputs[i].readings));
  model::Compensator<model::DoubleArithmetic> compensator(model);
  std::vector<std::vector<double>> out(seen.joints.size());
  std::vector<double> row(lines.size());
  for (std::size_t k = 0; k < seen.reading.front().size(); ++k) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = correction[i](seen.reading[i][k]);
    const auto samples = compensator.step(row);
    for (std::size_t s = 0; s < out.size(); ++s) out[s].push_back(samples[seen.joints[s].joint].angle_deg);
  }
  return out;
}

// The residual whose square is minus twice the logarithm of Student's density.
double tailed(double e) { return std::copysign(std::sqrt(kFreedom * std::log1p(e * e / kFreedom)), e); }

// Residuals of the prior and of all evidence. Unknown are shift and logarithm of the gain of each sensor, what all shifts have in
// common, how both poses were held, where each stretch of motion lies, and how each joint's marks sit.
struct LineProblem {
  const model::Model& model;
  const std::vector<Case>& cases;
  const Seen* seen;

  Eigen::Index sensors() const { return column(cases.size()); }
  Eigen::Index marks() const { return sensors() + 3 + std::ssize(cases.front().windows); }
  Eigen::Index size() const { return marks() + (seen != nullptr ? std::ssize(seen->joints) : 0); }

  std::vector<Line> lines(const Eigen::VectorXd& p) const {
    std::vector<Line> out;
    for (Eigen::Index i = 0; i < sensors(); i += 2) out.push_back({p(i), p(i + 1)});
    return out;
  }

  Eigen::VectorXd operator()(const Eigen::VectorXd& p, Eigen::MatrixXd* jacobian) const {
    Eigen::VectorXd r = residuals(p);
    if (jacobian == nullptr) return r;
    jacobian->resize(r.size(), p.size());
    for (Eigen::Index c = 0; c < p.size(); ++c)
      jacobian->col(c) = (residuals(p + kStep * Eigen::VectorXd::Unit(p.size(), c)) - r) / kStep;
    return r;
  }

  // From `p` on; the unknowns of `fixed` stay 0.
  Eigen::VectorXd solved(Eigen::VectorXd p, const std::vector<Eigen::Index>& fixed = {}) const {
    Eigen::VectorXd most = Eigen::VectorXd::Constant(size(), HUGE_VAL);
    for (Eigen::Index gain = 1; gain < sensors(); gain += 2) most(gain) = kMostLogGain;
    for (const Eigen::Index at : fixed) most(at) = 0;
    (void)levenberg_marquardt(*this, -most, most, {100, 1e-12, 1e-9}, p);
    return p;
  }

  // Of full rank by the prior's rows.
  Eigen::MatrixXd covariance(const Eigen::VectorXd& p) const {
    Eigen::MatrixXd jacobian;
    (void)(*this)(p, &jacobian);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(jacobian);
    const Eigen::MatrixXd upper = qr.matrixQR().topRows(size()).triangularView<Eigen::Upper>();
    const Eigen::MatrixXd inverse =
        upper.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(size(), size()));
    return inverse * inverse.transpose();
  }

  Eigen::VectorXd residuals(const Eigen::VectorXd& p) const {
    const std::vector<Line> all = lines(p);
    const auto shared = p.tail(p.size() - sensors());  // of unit variance
    std::vector<double> r(shared.begin(), shared.end());
    for (std::size_t i = 0; i < all.size(); ++i) {
      // The common shift in its standard deviations; of one sensor alone it is all of the shift's.
      const Prior& prior = cases[i].prior;
      const double alike = all.size() > 1 ? prior.alike : 0;
      const double common = prior.shift_sd * std::sqrt(alike);
      const double off = (all[i].shift - common * shared(0)) / (prior.shift_sd * std::sqrt(1 - alike));
      r.push_back(all.size() > 1 ? tailed(off) : off);
      r.push_back(all[i].log_gain / prior.log_gain_sd);
      const Case& one = cases[i];
      const auto off_by = [&](double reading, double made) {
        return (made_of(all[i], one.made, reading) - made) / one.made.span();
      };
      const auto add_pose = [&](double reading, double made, double place) {
        const double error = std::min(kMostPoseError, kPose_deg / std::abs(one.reach.most_deg));
        const double way = (one.poses->fist - one.poses->open) / one.made.span();
        if (!std::isnan(reading)) r.push_back((off_by(reading, made) - way * place) / error);
      };
      if (one.poses) add_pose(one.held.open, one.poses->open, sided(shared(1), kOpenBeyond, kOpenBent));
      if (one.poses) add_pose(one.held.fist, one.poses->fist, sided(shared(2), kFistShort, kFistBeyond));
      for (std::size_t log = 0; log < one.windows.size(); ++log) {
        if (!one.windows[log]) continue;
        const double lies = shared(3 + static_cast<Eigen::Index>(log));
        Eigen::VectorXd error(std::ssize(one.made.reading));
        for (std::size_t k = 0; k < one.made.reading.size(); ++k)
          error(static_cast<Eigen::Index>(k)) = off_by(one.windows[log]->reading[k], one.made.reading[k]) +
                                                prior.motion_sd * std::sqrt(kSameMotion) * lies;
        one.windows[log]->whitening.triangularView<Eigen::Lower>().solveInPlace(error);
        r.insert(r.end(), error.begin(), error.end());
      }
    }
    if (seen != nullptr) add_camera(p, r);
    return Eigen::Map<const Eigen::VectorXd>(r.data(), std::ssize(r));
  }

  void add_camera(const Eigen::VectorXd& p, std::vector<double>& r) const {
    const auto now = angles_by(lines(p), model, *seen);
    const double repeats = std::sqrt(std::max(1.0, kNews_s / model.sample_period_s));
    for (std::size_t s = 0; s < now.size(); ++s) {
      const Seen::Angles& one = seen->joints[s];
      const double error_deg = error_of(model.joints[one.joint]);
      const double mark_deg = kMarks_deg * p(marks() + static_cast<Eigen::Index>(s));
      for (std::size_t k = 0; k < one.use.size(); ++k)
        if (one.use[k])
          r.push_back(bend((now[s][k] + mark_deg - one.angle_deg[k]) / error_deg, kHuber).value / repeats);
    }
  }
};

}  // namespace

model::Correction correction_of(const Line& line, const model::Spread& made) {
  const double gain = std::exp(line.log_gain);
  return {gain, made.middle() * (1 - gain) + line.shift * made.span()};
}

Eigen::MatrixXd estimate(const model::Model& model, const Seen* seen, std::vector<Case>& cases) {
  for (Case& one : cases)
    for (auto& window : one.windows)
      if (window) window->whitening = covariance_of(one, *window).llt().matrixL();
  const LineProblem problem{model, cases, seen};
  Eigen::VectorXd p = problem.solved(Eigen::VectorXd::Zero(problem.size()));
  Eigen::MatrixXd c = problem.covariance(p);
  std::vector<Eigen::Index> fixed;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Eigen::Index at = column(i);
    FittedLine& fit = cases[i].fit;
    fit = {{}, false, c(at, at), c(at + 1, at + 1), c(at, at + 1)};
    fit.gain_is_determined = std::sqrt(fit.log_gain_variance) < kDetermined * cases[i].prior.log_gain_sd;
    if (!fit.gain_is_determined) fixed.push_back(at + 1);
  }
  if (!fixed.empty()) p = problem.solved(p, fixed);
  for (std::size_t i = 0; i < cases.size(); ++i) cases[i].fit.line = problem.lines(p)[i];
  return c;
}

std::vector<SeenFit> fits_of(const model::Model& model, const Seen& seen, const std::vector<Case>& cases) {
  std::vector<Line> lines;
  for (const Case& one : cases) lines.push_back(one.fit.line);
  const auto was = angles_by(std::vector<Line>(lines.size()), model, seen);
  const auto is = angles_by(lines, model, seen);
  std::vector<SeenFit> out(seen.joints.size());
  for (std::size_t s = 0; s < out.size(); ++s) {
    const Seen::Angles& one = seen.joints[s];
    Eigen::ArrayX3d deg(std::ranges::count(one.use, 1), 3);
    Eigen::Index at = 0;
    for (std::size_t k = 0; k < one.use.size(); ++k)
      if (one.use[k]) deg.row(at++) << one.angle_deg[k], was[s][k], is[s][k];
    if (at == 0) continue;  // its sensor is dead
    out[s].rmse_deg = std::sqrt((deg.col(2) - deg.col(0)).square().mean());
    out[s].expected_deg = std::hypot(error_of(model.joints[one.joint]), kMarks_deg);
    deg.rowwise() -= deg.colwise().mean().eval();
    const auto square = deg.square().colwise().mean().eval();
    if (square(0) > kMarks_deg * kMarks_deg)
      out[s].alike = (deg.col(0) * deg.col(1)).mean() / std::sqrt(square(0) * square(1));
  }
  return out;
}

}  // namespace flexor::identify
