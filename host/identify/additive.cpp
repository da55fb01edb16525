#include "host/identify/additive.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "host/identify/additive_system.hpp"
#include "host/identify/fit.hpp"
#include "host/identify/hold.hpp"
#include "host/identify/robust.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kLeastBlocks = 6;  // of the bootstrap
constexpr double kClamped = 1e-4;        // weight of what of an estimate lies beyond the limits, squared
constexpr double kLeastAtEnd = 20;       // samples that tell a limit
constexpr int kSteps = 8;                // of the iteration
constexpr double kDone = 1e-3;           // relative decrease of the loss
constexpr std::size_t kGroups = 10;      // of estimates, each with its own error
constexpr double kApart_deg = 0.5;
constexpr double kPooled =
    0.5;  // of a group's mean square error: a few movements in one group say little of the next
// On another part of a motion errors are larger than over the folds, which have data on either side: with this factor 73 and 91 %
// of the errors on 18 unseen halves of real recordings lie within one and 1.96 standard errors (54 and 79 % without both).
constexpr double kElsewhere = 1.35;
constexpr double kLeastError_deg = 0.01;
constexpr int kLeastSamples = 40;       // two seconds at 20 Hz
constexpr int kShrinks = 6;             // of motion that drifts
constexpr double kCostsNothing = 1.03;  // of the fitted error
constexpr double kSeveral = 0.1;  // of the error, by which a smaller sum of several sensors may be larger
constexpr int kFineKnots = 20;
constexpr double kReach = 0.5;        // likewise, of the range of a curve's knots
constexpr double kTallest_deg = 250;  // a taller curve has not the eight fraction bits in 16
constexpr double kLevel = 0.2;
constexpr int kLevelSteps = 15;
constexpr double kBlock_s = 20;  // of the bootstrap
constexpr int kDraws = 100;
constexpr unsigned kSeed = 2019;

// Where a fit stands: coefficients, centre and limits of the angle, and the least-squares problem that has the
// loss's slope there. Of an estimate beyond the limits, what is beyond them does not count.
class Fit {
 public:
  Fit(const System& system, const model::Saturation& limits, double centre)
      : system_(&system), limits_(limits), centre_(centre) {
    move(VectorXd::Zero(system.columns()));
    weight_ = system.weight();  // the first step is plain least squares
    target_ = (system.angle().array() - centre_).matrix();
  }

  // Steps of least squares, each halved until it lowers loss and prior together.
  void descend(const MatrixXd& penalty, bool first) {
    double least = std::numeric_limits<double>::infinity();
    if (!first) least = objective(coefficients_, penalty);
    for (int step = 0; step < kSteps; ++step) {
      const MatrixXd gram = this->gram() + penalty;
      const VectorXd right = system_->project(0, weight_.cwiseProduct(target_));
      const VectorXd to = gram.selfadjointView<Eigen::Lower>().llt().solve(right) - coefficients_;
      double share = 1;
      double next = 0;
      for (;; share /= 2) {
        if (share < 0.02) return;
        next = objective(coefficients_ + share * to, penalty);
        if (next < least) break;
      }
      move(coefficients_ + share * to);
      if (least - next < kDone * next) return;
      least = next;
    }
  }

  // Each limit to the median of the angles whose estimates lie beyond it; where these are too few, to that of an open one.
  void move_limits(const model::Saturation& open) {
    std::vector<double> below;
    std::vector<double> above;
    for (Index r = 0; r < estimate_.size(); ++r) {
      if (system_->original()(r) == 0) continue;
      if (estimate_(r) < limits_.lower_deg) below.push_back(system_->angle()(r));
      if (estimate_(r) > limits_.upper_deg) above.push_back(system_->angle()(r));
    }
    const auto limit = [](std::vector<double> beyond, double none) {
      return static_cast<double>(beyond.size()) < kLeastAtEnd ? none : median(std::move(beyond));
    };
    limits_ = {limit(std::move(below), open.lower_deg), limit(std::move(above), open.upper_deg)};
    move(coefficients_);
  }

  // The weighted squares of all rows, in the lower triangle.
  const MatrixXd& gram() const {
    if (gram_.size() == 0) {
      gram_ = MatrixXd::Zero(system_->columns(), system_->columns());
      system_->add_gram(0, weight_, 1, gram_);
    }
    return gram_;
  }

  double clamped(double estimate) const { return std::clamp(estimate, limits_.lower_deg, limits_.upper_deg); }

  const System& system() const { return *system_; }
  const model::Saturation& limits() const { return limits_; }
  double centre() const { return centre_; }
  const VectorXd& weight() const { return weight_; }
  const VectorXd& target() const { return target_; }
  const VectorXd& coefficients() const { return coefficients_; }

  void limit(const model::Saturation& limits) {
    limits_ = limits;
    move(coefficients_);
  }

  // To these coefficients; the least-squares problem is then that where the next step begins.
  void move(VectorXd coefficients) {
    coefficients_ = std::move(coefficients);
    gram_.resize(0, 0);
    estimate_ = (system_->estimate(0, system_->rows(), coefficients_).array() + centre_).matrix();
    weight_ = system_->weight();
    target_.resize(estimate_.size());
    for (Index r = 0; r < estimate_.size(); ++r) {
      const double inside = clamped(estimate_(r));
      const double error = (inside - system_->angle()(r)) / kLoss_deg;
      const bool beyond = inside != estimate_(r);
      weight_(r) *= beyond ? kClamped : 1 / std::sqrt(1 + error * error);
      target_(r) = (beyond ? inside : system_->angle()(r)) - centre_;
    }
  }

  double objective(const VectorXd& coefficients, const MatrixXd& penalty) const {
    const VectorXd estimate = system_->estimate(0, system_->rows(), coefficients);
    double sum = coefficients.dot(penalty * coefficients);
    for (Index r = 0; r < estimate.size(); ++r) {
      const double angle = estimate(r) + centre_;
      const double beyond = angle - clamped(angle);
      sum +=
          system_->weight()(r) * (loss_of(clamped(angle) - system_->angle()(r)) + kClamped * beyond * beyond);
    }
    return sum;
  }

 private:
  const System* system_;
  model::Saturation limits_;
  double centre_;
  VectorXd coefficients_;
  VectorXd estimate_;
  VectorXd weight_;
  VectorXd target_;
  mutable MatrixXd gram_;  // empty: not computed since the last step
};

// What may be drawn in any order: whole recordings, or seconds enough for errors to forget each other.
std::vector<std::size_t> blocks_of(const Stack& stack, double period_s) {
  std::vector<std::size_t> out = {0};
  if (stack.begin.size() > 3) {
    for (const Fold& fold : folds_of(stack.used, stack.begin, period_s))
      out.push_back(stack.place(fold.front().last + 1));
    return out;
  }
  const std::size_t n = stack.used.size();
  const auto blocks =
      std::max(kLeastBlocks, static_cast<std::size_t>(static_cast<double>(n) * period_s / kBlock_s));
  for (std::size_t b = 1; b <= blocks; ++b) out.push_back(n * b / blocks);
  return out;
}

// Each fold estimated from the others, in the least-squares problem of a fit to all.
class CrossValidation {
 public:
  CrossValidation(const Fit& fit, const Stack& stack, double period_s) : fit_(fit) {
    const System& system = fit.system();
    const VectorXd weighted = fit.weight().cwiseProduct(fit.target());
    const MatrixXd& all = fit.gram();
    const VectorXd all_right = system.project(0, weighted);
    for (const Fold& one : folds_of(stack.used, stack.begin, period_s)) {
      LeftOut fold{{}, all, all_right, fit.limits()};
      VectorXd rest = system.original();
      std::size_t gone = 0;  // the guards of two blocks may meet
      for (const Block& block : one) {
        const std::size_t from = std::max(gone, stack.place(block.first - block.guard));
        gone = stack.place(block.last + block.guard + 1);
        const Index first = system.first()[from];
        const Index count = system.first()[gone] - first;
        fold.rows.emplace_back(system.first()[stack.place(block.first)],
                               system.first()[stack.place(block.last + 1)]);
        system.add_gram(first, fit.weight().segment(first, count), -1, fold.gram);
        fold.right -= system.project(first, weighted.segment(first, count));
        rest.segment(first, count).setZero();
      }
      fold.limits = within(system, rest, fold.limits);
      folds_.push_back(std::move(fold));
    }
  }

  // `shape` is given what a fold's fit left, with its squares.
  using Shape = std::function<VectorXd(const MatrixXd& gram, VectorXd coefficients)>;
  Validated error(const MatrixXd& penalty, const Shape& shape = {}) const {
    const System& system = fit_.system();
    Validated out;
    double count = 0;
    double squares = 0;
    MatrixXd gram;
    for (const LeftOut& fold : folds_) {
      gram = fold.gram + penalty;
      VectorXd c = gram.selfadjointView<Eigen::Lower>().llt().solve(fold.right);
      if (shape) c = shape(fold.gram, std::move(c));
      double loss = 0;
      double weight = 0;
      double plain = 0;
      double plain_count = 0;
      for (const auto& [begin, end] : fold.rows) {
        const VectorXd estimate = system.estimate(begin, end - begin, c);
        for (Index r = begin; r < end; ++r) {
          const double angle =
              std::clamp(estimate(r - begin) + fit_.centre(), fold.limits.lower_deg, fold.limits.upper_deg);
          const double e = angle - system.angle()(r);
          if (system.original()(r) != 0) out.estimate.emplace_back(angle, e);
          loss += system.weight()(r) * loss_of(e);
          squares += system.original()(r) * e * e;
          weight += system.weight()(r);
          plain += system.original()(r) * loss_of(e);
          plain_count += system.original()(r);
        }
      }
      out.fold_loss.push_back(loss / weight);
      out.plain_loss.push_back(plain / plain_count);
      count += plain_count;
    }
    out.cross_validated_deg = std::sqrt(squares / count);
    return out;
  }

 private:
  struct LeftOut {
    std::vector<std::pair<Index, Index>> rows;  // begin and end
    MatrixXd gram;  // of the samples that are fitted when this fold is not, lower triangle
    VectorXd right;
    model::Saturation limits;
  };

  // A fold's limits are no farther than the angles of the others, where it has any.
  static model::Saturation within(const System& system, const VectorXd& rows, model::Saturation limits) {
    const auto is_left = rows.array() != 0;
    const VectorXd& seen = system.angle();
    const double least = is_left.select(seen, limits.upper_deg).minCoeff();
    const double most = is_left.select(seen, limits.lower_deg).maxCoeff();
    return {limits.lower_deg < seen.minCoeff() ? limits.lower_deg : std::max(limits.lower_deg, least),
            limits.upper_deg > seen.maxCoeff() ? limits.upper_deg : std::min(limits.upper_deg, most)};
  }

  const Fit& fit_;
  std::vector<LeftOut> folds_;
};

// From the best of several starts, one of them nearly a line, each searched along its own axis in steps of a factor, from coarse
// to fine; those that the branches have.
Priors best_priors(const Branches& branches, bool by_recording, Priors best,
                   const std::function<double(const Priors&)>& error) {
  struct Axis {
    double Priors::*which;
    double least;
    double most;
  };
  std::vector<Axis> axes = {{&Priors::smooth, 1e-4, 1e4}};
  if (!branches.radii.empty()) axes.push_back({&Priors::plays, 1e-2, 1e4});
  if (!branches.lags_s.empty()) axes.push_back({&Priors::motion, 1e-5, 1e3});
  if (by_recording) axes.push_back({&Priors::donning, 1e-2, 1e4});
  double least = error(best);
  for (const Priors& start : {Priors{}, Priors{.smooth = 10}, Priors{.smooth = 10, .motion = 0.1},
                              Priors{.smooth = 1000, .motion = 0.1}, Priors{.smooth = 1, .plays = 0.1}}) {
    const double e = error(start);
    if (!(e < least)) continue;
    least = e;
    best = start;
  }
  for (const double factor : {10.0, 3.0}) {
    for (const Axis& axis : axes) {
      for (const double step : {factor, 1 / factor}) {
        for (;;) {
          Priors next = best;
          next.*axis.which *= step;
          if (next.*axis.which > axis.most || next.*axis.which < axis.least) break;
          const double e = error(next);
          if (!(e < least)) break;
          least = e;
          best = next;
        }
      }
    }
  }
  return best;
}

// Coefficients and limits of the fit, and how well it fits.
void take(const Fit& fit, Additive& out) {
  const System& system = fit.system();
  const VectorXd& w = fit.coefficients();
  out.offset_deg = fit.centre();
  out.set_coefficients(w, system.shared_columns());
  out.limits = fit.limits();
  double squares = 0;
  VectorXd shared = w;
  shared.tail(out.donning.size()).setZero();
  const VectorXd estimate = system.estimate(0, system.rows(), shared);
  for (Index k = 0; k < estimate.size(); ++k) {
    const double e = fit.clamped(estimate(k) + fit.centre()) - system.angle()(k);
    squares += system.original()(k) * e * e;
  }
  out.samples = static_cast<int>(system.original().sum());
  out.fitted_rmse_deg = std::sqrt(squares / out.samples);
  const MatrixXd penalty = system.penalty(out.priors);
  const MatrixXd share = MatrixXd(fit.gram() + penalty).selfadjointView<Eigen::Lower>().llt().solve(penalty);
  out.effective = static_cast<double>(w.size()) - share.trace();
}

// Once more by orthogonal factors of samples and priors together, in the least-squares problem of the fit.
void solve(const Fit& fit, Additive& out) {
  const System& system = fit.system();
  const MatrixXd root = system.penalty(out.priors).llt().matrixU();
  const VectorXd scale = fit.weight().cwiseSqrt();
  const Index rows = system.rows();
  const Index columns = system.columns();
  MatrixXd a(rows + columns, columns);
  a << MatrixXd(scale.asDiagonal() * system.x()), root;
  VectorXd b = VectorXd::Zero(a.rows());
  b.head(rows) = scale.cwiseProduct(fit.target());
  const Eigen::HouseholderQR<MatrixXd> qr(a);
  const VectorXd w = qr.solve(b);
  const VectorXd diagonal = qr.matrixQR().diagonal().cwiseAbs();
  out.condition = diagonal.maxCoeff() / diagonal.minCoeff();
  out.set_coefficients(w, system.shared_columns());
}

// Of the motions of a sensor together.
VectorXd motion_of(const Additive& fit, std::size_t sensor) {
  return fit.value.middleCols(fit.moving(sensor), std::ssize(fit.branches.lags_s)).rowwise().sum();
}

// Where nothing was read a curve may go on so steeply that fixed point holds it less finely: there all curves level
// off.
void level_off(Additive& out) {
  const Index last = out.value.rows() - 1;
  for (int step = 0; last > 1 && step < kLevelSteps; ++step) {
    MatrixXd run = out.value;  // the curves that will run: a reading's has what moves in it as well
    for (std::size_t s = 0; s < out.knots.size(); ++s) run.col(out.still(s)) += motion_of(out, s);
    if ((run.colwise().maxCoeff() - run.colwise().minCoeff()).maxCoeff() <= kTallest_deg) break;
    out.value.row(0) += kLevel * (out.value.row(1) - out.value.row(0));
    out.value.row(last) += kLevel * (out.value.row(last - 1) - out.value.row(last));
  }
}

// Covariance of the curves' values over blocks drawn with replacement, in the least-squares problem of the fit.
MatrixXd bootstrap(const Fit& fit, const Stack& stack, double period_s, const Additive& out) {
  const System& system = fit.system();
  const std::vector<std::size_t> blocks = blocks_of(stack, period_s);
  const std::size_t n = blocks.size() - 1;
  const VectorXd weighted = fit.weight().cwiseProduct(fit.target());
  std::vector<MatrixXd> gram(n, MatrixXd::Zero(system.columns(), system.columns()));
  std::vector<VectorXd> right;
  for (std::size_t b = 0; b < n; ++b) {
    const Index from = system.first()[blocks[b]];
    const Index count = system.first()[blocks[b + 1]] - from;
    system.add_gram(from, fit.weight().segment(from, count), 1, gram[b]);
    right.push_back(system.project(from, weighted.segment(from, count)));
  }
  std::mt19937 random(kSeed);
  MatrixXd spread(system.shared_columns(), kDraws);
  for (int draw = 0; draw < kDraws; ++draw) {
    MatrixXd drawn = system.penalty(out.priors);
    VectorXd drawn_right = VectorXd::Zero(system.columns());
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t b = random() % n;
      drawn += gram[b];
      drawn_right += right[b];
    }
    spread.col(draw) =
        drawn.selfadjointView<Eigen::Lower>().llt().solve(drawn_right).head(system.shared_columns());
  }
  spread.colwise() -= spread.rowwise().mean().eval();
  return spread * spread.transpose() / kDraws;
}

void validate(const CrossValidation& validation, const System& system, Additive& out,
              const CrossValidation::Shape& shape = {}) {
  static_cast<Validated&>(out) = validation.error(system.penalty(out.priors), shape);
  out.accuracy = accuracy_of(std::exchange(out.estimate, {}));  // a candidate keeps what follows from them
}

// The search over candidates of one joint.
class Search {
 public:
  Search(const Stack& stack, double period_s) : stack_(stack), period_s_(period_s) {}

  // Coefficients, limits, priors and cross-validated error. With limits the loss has several minima: the
  // lower one of two starts, by least squares and from the open fit.
  Additive fit(const Branches& branches) const {
    const model::Saturation ends = limits_of(stack_, kEnds);
    const System system(stack_, branches, period_s_, ends);
    const MatrixXd first = system.penalty({});
    const VectorXd angle = stack_.angle(stack_.used);
    Fit fit(system, open_limits(angle), limits_of(stack_, 0.5).lower_deg);
    fit.descend(first, true);
    if (!branches.open) {
      const model::Saturation limits = limits_at_rest(angle, stack_.input.col(0)(stack_.used), 0);
      Fit cold(system, limits, fit.centre());
      cold.descend(first, true);
      fit.limit(limits);
      fit.descend(first, false);
      if (cold.objective(cold.coefficients(), first) < fit.objective(fit.coefficients(), first)) fit = cold;
    }
    Additive out;
    out.branches = branches;
    out.knots = system.knots();
    out.radii = system.radii();
    const CrossValidation validation(fit, stack_, period_s_);
    out.priors = best_priors(branches, stack_.begin.size() > 3, out.priors, [&](const Priors& priors) {
      return mean(validation.error(system.penalty(priors)).fold_loss);
    });
    fit.descend(system.penalty(out.priors), false);
    if (!branches.open) {
      fit.move_limits(open_limits(angle));
      fit.descend(system.penalty(out.priors), false);
    }
    validate(CrossValidation(fit, stack_, period_s_), system, out);
    take(fit, out);
    return out;
  }

  // As it ships: solved to the last digit, level where nothing was read, without turns that are in doubt, its drift measured.
  // Where it drifts too far its motion is shrunk until it does not, or left if that does not help. What is validated is what ships.
  void finish(const Drift& drift, Additive& out) const {
    const System system(stack_, out.branches, period_s_, limits_of(stack_, kEnds));
    Fit fit(system, out.limits, out.offset_deg);
    fit.move(out.coefficients());
    Additive next = out;
    for (int tries = 0; tries <= kShrinks; ++tries) {
      if (tries > 0) {
        next.priors.motion *= 10;
        fit.descend(system.penalty(next.priors), false);
        take(fit, next);
      }
      finish_once(fit, next.fitted_rmse_deg, next);
      next.hold_drift_deg = drift(next);
      const bool holds =
          next.branches.lags_s.empty() || creeps(next.branches) || *next.hold_drift_deg <= kMostDrift_deg;
      if (tries == 0 || holds) out = next;
      if (holds) return;
    }
  }

 private:
  void finish_once(const Fit& fit, double free_deg, Additive& out) const {
    const System& system = fit.system();
    const MatrixXd penalty = system.penalty(out.priors);
    out.covariance = bootstrap(fit, stack_, period_s_, out);
    solve(fit, out);
    const VectorXd free = out.coefficients();
    const auto shipped = [&](bool turns) {
      const auto shape = [&](const MatrixXd& gram, const VectorXd& coefficients) {
        Additive one = out;
        one.set_coefficients(coefficients, out.value.size());
        if (!turns) make_monotone(gram, penalty, one);
        level_off(one);
        return one.coefficients();
      };
      Fit done = fit;
      done.move(shape(fit.gram(), free));
      Additive one = out;
      take(done, one);
      validate(CrossValidation(fit, stack_, period_s_), system, one, shape);
      return one;
    };
    out = shipped(false);
    if (out.fitted_rmse_deg <= kCostsNothing * free_deg) return;
    Additive turning = shipped(true);
    if (kCostsNothing * mean(turning.fold_loss) < mean(out.fold_loss)) out = std::move(turning);
  }

  const Stack& stack_;
  double period_s_;
};

template <class Signal>
std::vector<double> used(std::span<const Session> sessions, const Signal& signal) {
  std::vector<double> out;
  for (const Session& s : sessions)
    for (std::size_t k = 0; k < s.use.size(); ++k)
      if (s.use[k] != 0) out.push_back(signal(s)(static_cast<Index>(k)));
  return out;
}

}  // namespace

std::vector<double> used_readings(std::span<const Session> sessions, Index sensor) {
  return used(sessions, [sensor](const Session& s) { return s.input.col(sensor); });
}

std::vector<double> used_angles(std::span<const Session> sessions) {
  return used(sessions, [](const Session& s) -> const VectorXd& { return s.angle_deg; });
}

model::Accuracy accuracy_of(std::vector<std::pair<double, double>> estimate) {
  std::ranges::sort(estimate);
  const auto mean_square = [&](std::size_t from, std::size_t to) {
    double out = 0;
    for (std::size_t k = from; k < to; ++k)
      out += estimate[k].second * estimate[k].second / static_cast<double>(to - from);
    return out;
  };
  model::Accuracy out;
  const std::size_t n = estimate.size();
  const double pooled = mean_square(0, n);
  for (std::size_t g = 0; g < kGroups; ++g) {
    double angle = 0;
    const std::size_t from = n * g / kGroups;
    const std::size_t to = n * (g + 1) / kGroups;
    for (std::size_t k = from; k < to; ++k) angle += estimate[k].first / static_cast<double>(to - from);
    const double square = kPooled * pooled + (1 - kPooled) * mean_square(from, to);
    const double error = std::max(kElsewhere * std::sqrt(square), kLeastError_deg);
    // Groups at one limit have one angle between them.
    if (!out.angle_deg.empty() && angle < out.angle_deg.back() + kApart_deg) {
      out.standard_error_deg.back() = std::max(out.standard_error_deg.back(), error);
      continue;
    }
    out.angle_deg.push_back(angle);
    out.standard_error_deg.push_back(error);
  }
  return out;
}

// Each open, then each with limits.
std::vector<Branches> both(std::vector<Branches> all) {
  const std::size_t n = all.size();
  for (std::size_t k = 0; k < n; ++k) {
    all.push_back(all[k]);
    all[k].open = true;
  }
  return all;
}

Candidates candidates(const std::string& name, std::size_t sensors) {
  const std::vector<double> plays = {0.03, 0.08, 0.16};
  const std::vector<double> one = {0.2};
  const std::vector<double> quick = {0.1, 0.3};
  const std::vector<double> slow = {0.15, 0.6};
  const std::vector<double> wide = {0.05, 0.2, 0.8, 3};
  if (name == "limited-line") return {{{{}, {}, 2}}};
  if (name == "line-lead")
    return {both(
        {{{}, {0.05}, 2}, {{}, {0.1}, 2}, {{}, {0.2}, 2}, {{}, {0.4}, 2}, {{}, {0.8}, 2}, {{}, wide, 2}})};
  if (name == "curve") return {both({{{}, {}}})};
  if (name == "hysteresis") return {both({{plays, {}}})};
  if (name != "auto") throw io::InputError("no structure is called \"{}\"", name);
  // The curve first: a search that is stopped has that at least. What several sensors say together needs less of each, and is
  // slower to fit.
  std::vector<Branches> out = {{{}, {}}, {{}, slow}, {plays, {}}, {plays, quick}, {plays, slow}, {{}, wide}};
  if (sensors == 1) out.insert(out.begin() + 1, {{{}, one}, {{}, quick}, {{}, {0.5, 2}}});
  for (Branches& branches : out) branches.open = true;
  for (Branches& line : both({{{}, {}, 2}, {{}, {0.1}, 2}, {{}, {0.4}, 2}, {{}, wide, 2}}))
    out.push_back(std::move(line));
  return {out, true};
}

bool creeps(const Branches& b) { return !b.lags_s.empty() && std::ranges::max(b.lags_s) > kCreep_s; }

double gain_in_errors(const std::vector<double>& one, const std::vector<double>& other) {
  const Eigen::Map<const Eigen::ArrayXd> a(one.data(), std::ssize(one));
  const Eigen::Map<const Eigen::ArrayXd> b(other.data(), std::ssize(other));
  const Eigen::ArrayXd gain = b - a;
  const auto n = static_cast<double>(gain.size());
  const double error = std::sqrt((gain - gain.mean()).square().sum() / (n - 1) / n);
  return gain.mean() == 0 ? 0 : gain.mean() / error;
}

std::string describe(const Branches& b) {
  std::string out = b.knots == 2 ? "limited line" : fmt::format("curves of {} knots", b.knots);
  if (!b.radii.empty()) out += fmt::format(", {} play{}", b.radii.size(), b.radii.size() > 1 ? "s" : "");
  if (!b.lags_s.empty()) out += fmt::format(", motion over {} s", fmt::join(b.lags_s, " and "));
  if (b.open) out += ", open";
  return out;
}

// Not of those within a standard error: on a short recording one fold has most of the loss, and all are. Several sensors' branches
// are many: of their sums those within a standard error that err little more are as good. A larger one was chosen by chance there,
// and erred more in gestures that no fold has seen.
void rank(std::vector<Additive>::iterator begin, std::vector<Additive>::iterator end) {
  const auto loss = [](const Additive& one) { return mean(one.fold_loss); };
  const Additive best = *std::ranges::min_element(begin, end, {}, loss);
  std::sort(begin, end, [&](const Additive& a, const Additive& b) {
    const auto key = [&](const Additive& one) {
      const bool as_good = loss(one) <= (1 + kAsGood) * (1 + kAsGood) * loss(best) &&
                           one.cross_validated_deg <= (1 + kAsGood) * best.cross_validated_deg;
      const bool is_enough = one.knots.size() > 1 && gain_in_errors(best.fold_loss, one.fold_loss) <= 1 &&
                             one.cross_validated_deg <= (1 + kSeveral) * best.cross_validated_deg;
      // Of equals the open one, which does not stop where nothing was seen.
      return std::pair(
          as_good || is_enough ? static_cast<double>(one.value.size()) - (one.branches.open ? 0.5 : 0) : 1e9,
          loss(one));
    };
    return key(a) < key(b);
  });
}

namespace {

// Of the best open curves two that hold still and two that creep.
std::vector<Branches> with_limits(const std::vector<Additive>& ranked) {
  std::vector<Branches> out;
  int still = 2;
  int creeping = 2;
  for (const Additive& one : ranked) {
    Branches limited = one.branches;
    int& left = creeps(limited) ? creeping : still;
    if (limited.knots == 2 || left-- <= 0) continue;
    limited.open = false;
    out.push_back(limited);
  }
  return out;
}

// An angle stops at what was seen where that is better by more than a standard error.
void leave_out_needless_limits(std::vector<Additive>& all) {
  const auto is_needless = [&](const Additive& one) {
    Branches twin = one.branches;
    twin.open = true;
    const auto open = std::ranges::find(all, twin, &Additive::branches);
    return !one.branches.open && open != all.end() && gain_in_errors(one.plain_loss, open->plain_loss) <= 1;
  };
  for (auto one = all.begin(); one != all.end();) one = is_needless(*one) ? all.erase(one) : one + 1;
}

}  // namespace

std::vector<Additive> fit_additive(const std::vector<Session>& sessions, double period_s,
                                   const std::string& joint, const Candidates& candidates, const Drift& drift,
                                   const Accept& accept, const Step& step) {
  const Stack stack(sessions);
  if (std::ssize(stack.used) < kLeastSamples)
    throw io::JobError("{}: {} samples to fit, at least {} are needed: record longer", joint,
                       stack.used.size(), kLeastSamples);
  const model::Saturation ends = limits_of(stack, kEnds);
  if (!(ends.upper_deg > ends.lower_deg)) throw io::JobError("{}: its angle hardly changes", joint);
  const Search search(stack, period_s);
  std::vector<Branches> all = candidates.branches;
  std::vector<Additive> out;
  const auto goes_on = [&] {
    const std::size_t done = out.size();
    return out.empty() || !step || step(done, all.size(), fmt::format("{}: {}", joint, describe(all[done])));
  };
  const auto try_all = [&] {
    while (out.size() < all.size() && goes_on()) out.push_back(search.fit(all[out.size()]));
  };
  const auto add = [&](const Branches& branches) {
    if (std::ranges::find(all, branches) == all.end()) all.push_back(branches);
  };
  try_all();
  if (candidates.search && stack.input.cols() == 1) {
    rank(out.begin(), out.end());
    const Branches best = out.front().branches;
    for (Branches branches : candidates.branches) {
      const bool moves = branches.radii.empty() && branches.lags_s.size() > 1 && branches.knots > 2;
      if (!moves && !(branches == best)) continue;
      branches.knots = kFineKnots;
      add(branches);
    }
    try_all();
  }
  if (candidates.search) {
    rank(out.begin(), out.end());
    std::ranges::for_each(with_limits(out), add);
    try_all();
  }
  leave_out_needless_limits(out);
  for (auto next = out.begin(); next != out.end(); ++next) {
    // A finished one can be worse than it was.
    for (;;) {
      rank(next, out.end());
      if (next->hold_drift_deg) break;
      search.finish(drift, *next);
    }
    if (accept(*next)) break;
  }
  return out;
}

namespace {

// Its curves go on as straight as at their ends, alike, by the range of their knots or as far as fixed point holds them.
void extend(Additive& fit, std::size_t sensor) {
  std::vector<double>& x = fit.knots[sensor];
  std::vector<Index> columns;
  for (std::size_t b = 0; b < fit.branches.still(); ++b)
    columns.push_back(fit.still(sensor) + static_cast<Index>(b));
  for (std::size_t l = 0; l < fit.branches.lags_s.size(); ++l)
    columns.push_back(fit.moving(sensor) + static_cast<Index>(l));
  const std::size_t last = x.size() - 1;
  const double most = kReach * (x[last] - x[0]);
  const auto n = static_cast<Index>(last);
  // Over the outer third of what was read, which the outermost knots lie beyond.
  const std::size_t edge = last > 3 ? 1 : 0;
  const double third = (x[last - edge] - x[edge]) / 3;
  std::size_t low = edge;
  std::size_t high = last - edge;
  while (x[low] < x[edge] + third) ++low;
  while (x[high] > x[last - edge] - third) --high;
  const auto between = [&](const VectorXd& y, std::size_t a, std::size_t b) {
    return (y(static_cast<Index>(b)) - y(static_cast<Index>(a))) / (x[b] - x[a]);
  };
  const auto slope = [&](const VectorXd& y, bool is_high) {
    return is_high ? between(y, high, last - edge) : -between(y, edge, low);
  };
  double by = most;
  const auto bound = [&](const VectorXd& y) {
    const double run = std::abs(slope(y, false)) + std::abs(slope(y, true));
    if (run > 0) by = std::min(by, std::max(0.0, kTallest_deg - (y.maxCoeff() - y.minCoeff())) / run);
  };
  for (const Index c : columns) bound(fit.value.col(c));
  bound(fit.value.col(fit.still(sensor)) + motion_of(fit, sensor));
  for (const Index c : columns) {
    const VectorXd y = fit.value.col(c);
    fit.value(0, c) = y(static_cast<Index>(edge)) + (x[edge] - x[0] + by) * slope(y, false);
    fit.value(n, c) = y(n - static_cast<Index>(edge)) + (x[last] - x[last - edge] + by) * slope(y, true);
  }
  x[0] -= by;
  x[last] += by;
}

}  // namespace

void add_to(model::Model& model, Additive fit, const std::vector<std::string>& inputs,
            const std::string& joint) {
  for (std::size_t s = 0; s < inputs.size(); ++s) extend(fit, s);
  model::Sum sum;
  sum.offset = fit.offset_deg;
  std::vector<std::string> terms;
  const auto add = [&](const std::string& from, const std::string& to, model::Kind kind) {
    model.blocks.push_back({{from}, to, std::move(kind)});
    return to;
  };
  // About the middle of its values, where fixed point is finest; what it is moved by is one number for all.
  const auto middle = [](const VectorXd& y) { return 0.5 * (y.minCoeff() + y.maxCoeff()); };
  const auto curve = [&](std::size_t sensor, VectorXd y, double weight) {
    sum.offset += weight * middle(y);
    y.array() -= middle(y);
    return model::Curve{fit.knots[sensor], {y.begin(), y.end()}};
  };
  const auto term = [&](const std::string& signal, double weight) {
    terms.push_back(signal);
    sum.weights.push_back(weight);
  };
  const auto radii = static_cast<int>(fit.branches.radii.size());
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    const std::string name = inputs.size() > 1 ? fmt::format("{} {}", joint, inputs[s]) : joint;
    // f(u) - H f(u): its first part is in the curve of the reading itself.
    term(add(inputs[s], name + " curve", curve(s, fit.value.col(fit.still(s)) + motion_of(fit, s), 1)), 1);
    for (int r = 0; r < radii; ++r) {
      const double radius = fit.radii[s][static_cast<std::size_t>(r)];
      const std::string p = add(inputs[s], fmt::format("{} play {}", name, r + 1), model::Play{radius});
      term(add(p, fmt::format("{} curve {}", name, r + 1), curve(s, fit.value.col(fit.still(s) + 1 + r), 1)),
           1);
    }
    for (std::size_t l = 0; l < fit.branches.lags_s.size(); ++l) {
      const std::string c = add(inputs[s], fmt::format("{} motion {}", name, l + 1),
                                curve(s, fit.value.col(fit.moving(s) + static_cast<Index>(l)), -1));
      term(add(c, fmt::format("{} lag {}", name, l + 1), model::Lag{1 / fit.branches.lags_s[l]}), -1);
    }
  }
  const std::string total = joint + " sum";
  model.blocks.push_back({terms, total, sum});
  add(total, joint + " angle", fit.limits);
  model.joints.push_back({joint, joint + " angle", fit.offset_deg, fit.accuracy});
}

}  // namespace flexor::identify
