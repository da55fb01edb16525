#include "host/identify/additive.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "host/identify/robust.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kFolds = 6;   // of the cross-validation
constexpr double kFoldGuard_s = 1;  // beside each block
constexpr double kBeyond = 0.25;    // knots beyond the readings, as a share of their range
constexpr double kAnchor = 1e-4;    // prior weight of the reading's own values: only where nothing tells them
constexpr double kHuber = 3;        // robust deviations
constexpr double kAsGood = 0.01;    // a simpler candidate so close to the best is as good
constexpr int kLeastSamples = 100;
constexpr int kShrinks = 6;         // of motion that drifts
constexpr double kMargin = 0.1;     // of the measured range, beyond which no angle goes
constexpr double kGrid = 1.0 / 32;  // knots lie on the steps of Q5 where the readings are that coarse

// With several sensors the shorter ones: what they say together needs fewer knots of each.
std::vector<Branches> candidates(Index sensors) {
  const std::vector<double> few = {0.03, 0.08, 0.16};
  const std::vector<double> many = {0.02, 0.05, 0.1, 0.2, 0.35};
  const std::vector<double> lags = {0.15, 0.6};
  const std::vector<double> quick = {0.1, 0.3};
  if (sensors > 1) return {{{}, {}, 12}, {{}, lags, 12}, {few, {}, 12}, {few, lags, 12}, {few, quick, 12}};
  return {{{}, {}, 12},  {{}, {}, 20},    {{}, lags, 12},  {{}, lags, 20},   {few, {}, 12},
          {few, {}, 20}, {few, lags, 12}, {few, lags, 20}, {few, quick, 20}, {many, quick, 20}};
}

int count_of(const Branches& b) { return 1 + static_cast<int>(b.radii.size() + b.lags_s.size()); }

// The samples of all sessions in one row of rows.
struct Stack {
  MatrixXd input;
  VectorXd angle;
  std::vector<Index> used;   // rows whose error counts
  std::vector<Index> begin;  // of each session
  double mean = 0;           // of the used angles

  explicit Stack(const std::vector<Session>& sessions) {
    Index rows = 0;
    for (const Session& s : sessions) rows += s.angle_deg.size();
    input.resize(rows, sessions.front().input.cols());
    angle.resize(rows);
    Index at = 0;
    for (const Session& s : sessions) {
      begin.push_back(at);
      input.middleRows(at, s.angle_deg.size()) = s.input;
      angle.segment(at, s.angle_deg.size()) = s.angle_deg;
      for (std::size_t k = 0; k < s.use.size(); ++k) {
        if (s.use[k]) used.push_back(at + static_cast<Index>(k));
      }
      at += s.angle_deg.size();
    }
    begin.push_back(rows);
    if (!used.empty()) mean = angle(used).mean();
  }
};

struct Range {
  double low = 0;
  double high = 0;
  double width() const { return high - low; }
};

Range range_of(const Stack& stack, Index sensor) {
  const VectorXd u = stack.input(stack.used, sensor);
  return {u.minCoeff(), u.maxCoeff()};
}

// Quantiles of the readings, apart from one another, and one knot beyond each end: there the smoothness carries
// the curve on straight.
std::vector<double> knots_of(const Stack& stack, Index sensor, int count) {
  const VectorXd column = stack.input(stack.used, sensor);
  std::vector<double> u(column.begin(), column.end());
  std::ranges::sort(u);
  const double range = u.back() - u.front();
  const int inner = count - 2;
  const double least = range / (4 * inner);
  std::vector<double> out;
  for (int i = 0; i < inner; ++i) {
    // Half by where the readings are, half by where they could be.
    const double share = i / (inner - 1.0);
    const double at = 0.5 * quantile(u, share) + 0.5 * (u.front() + share * range);
    out.push_back(out.empty() ? at : std::max(at, out.back() + least));
  }
  out.insert(out.begin(), u.front() - kBeyond * range);
  out.push_back(std::max(u.back(), out.back()) + kBeyond * range);
  if (range > 100 * kGrid * count) {
    for (double& x : out) x = std::round(x / kGrid) * kGrid;
  }
  return out;
}

// Piecewise-linear interpolation: two hats for each reading.
void hats(const VectorXd& u, const std::vector<double>& knots, Eigen::Ref<MatrixXd> out) {
  out.setZero();
  for (Index k = 0; k < u.size(); ++k) {
    const double x = std::clamp(u(k), knots.front(), knots.back());
    const auto next = std::ranges::upper_bound(knots, x);
    const auto i = std::clamp<std::ptrdiff_t>(next - knots.begin() - 1, 0, std::ssize(knots) - 2);
    const auto at = static_cast<std::size_t>(i);
    const double share = (x - knots[at]) / (knots[at + 1] - knots[at]);
    out(k, i) = 1 - share;
    out(k, i + 1) = share;
  }
}

VectorXd play(const Stack& stack, Index sensor, double radius) {
  VectorXd out = stack.input.col(sensor);
  for (std::size_t s = 0; s + 1 < stack.begin.size(); ++s) {
    double p = out(stack.begin[s]);
    for (Index k = stack.begin[s]; k < stack.begin[s + 1]; ++k) {
      p = std::min(out(k) + radius, std::max(out(k) - radius, p));
      out(k) = p;
    }
  }
  return out;
}

// x - H_tau x, column by column, each session from rest.
void take_out_lag(const Stack& stack, double lag_s, double period_s, Eigen::Ref<MatrixXd> x) {
  const double keep = std::exp(-period_s / lag_s);
  for (std::size_t s = 0; s + 1 < stack.begin.size(); ++s) {
    Eigen::RowVectorXd state = x.row(stack.begin[s]);
    for (Index k = stack.begin[s]; k < stack.begin[s + 1]; ++k) {
      state = keep * state + (1 - keep) * x.row(k);
      x.row(k) -= state;
    }
  }
}

// The linear system of one candidate.
class System {
 public:
  System(const Stack& stack, const Branches& branches, double period_s)
      : branches_(branches), per_sensor_(count_of(branches)) {
    const Index sensors = stack.input.cols();
    columns_ = sensors * per_sensor_ * branches.knots;
    x_.resize(stack.input.rows(), columns_);
    Index at = 0;
    const auto next = [&] {
      at += branches.knots;
      return x_.middleCols(at - branches.knots, branches.knots);
    };
    for (Index s = 0; s < sensors; ++s) {
      knots_.push_back(knots_of(stack, s, branches.knots));
      const std::vector<double>& knots = knots_.back();
      const VectorXd u = stack.input.col(s);
      hats(u, knots, next());
      const double range = range_of(stack, s).width();
      radii_.emplace_back();
      for (const double share : branches.radii) {
        radii_.back().push_back(share * range);
        hats(play(stack, s, share * range), knots, next());
      }
      for (const double lag_s : branches.lags_s) {
        auto block = next();
        hats(u, knots, block);
        take_out_lag(stack, lag_s, period_s, block);
      }
    }
    make_penalties();
  }

  Index columns() const { return columns_; }
  const std::vector<std::vector<double>>& knots() const { return knots_; }
  const std::vector<std::vector<double>>& radii() const { return radii_; }
  const MatrixXd& x() const { return x_; }

  MatrixXd penalty(const Priors& priors, double variance) const {
    MatrixXd out = variance * priors.smooth * smooth_;
    out.diagonal() += variance * (priors.plays * plays_ + priors.motion * motion_).array().matrix();
    out.diagonal().array() += variance * kAnchor;
    return out;
  }

 private:
  void make_penalties() {
    smooth_ = MatrixXd::Zero(columns_, columns_);
    plays_ = VectorXd::Zero(columns_);
    motion_ = VectorXd::Zero(columns_);
    const Index n = branches_.knots;
    for (std::size_t s = 0; s < knots_.size(); ++s) {
      const MatrixXd bend = second_differences(knots_[s]);
      for (int b = 0; b < per_sensor_; ++b) {
        const Index at = (static_cast<Index>(s) * per_sensor_ + b) * n;
        smooth_.block(at, at, n, n) = bend.transpose() * bend;
        const bool motion = b > static_cast<int>(branches_.radii.size());
        if (b > 0) (motion ? motion_ : plays_).segment(at, n).setOnes();
      }
    }
  }

  // Of slopes, scaled to the mean distance of the knots.
  static MatrixXd second_differences(const std::vector<double>& x) {
    const auto n = static_cast<Index>(x.size());
    MatrixXd d = MatrixXd::Zero(n - 2, n);
    const double mean = (x.back() - x.front()) / static_cast<double>(n - 1);
    for (Index i = 0; i < n - 2; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double left = mean / (x[k + 1] - x[k]);
      const double right = mean / (x[k + 2] - x[k + 1]);
      d(i, i) = left;
      d(i, i + 1) = -left - right;
      d(i, i + 2) = right;
    }
    return d;
  }

  const Branches& branches_;
  int per_sensor_;
  Index columns_ = 0;
  std::vector<std::vector<double>> knots_;
  std::vector<std::vector<double>> radii_;
  MatrixXd x_;
  MatrixXd smooth_;
  VectorXd plays_;  // ones where the prior counts
  VectorXd motion_;
};

// Sums over one block of the cross-validation, and over what must be left out with it.
struct Block {
  MatrixXd gram;  // of the samples that are fitted when this block is not
  VectorXd right;
  MatrixXd x;  // of the block itself
  VectorXd y;
  VectorXd weight;
};

class CrossValidation {
 public:
  CrossValidation(const System& system, const Stack& stack, const VectorXd& weight, double period_s) {
    const auto guard = static_cast<Index>(std::lround(kFoldGuard_s / period_s));
    const std::vector<Index>& used = stack.used;
    const VectorXd y = (stack.angle.array() - stack.mean).matrix();
    MatrixXd all = MatrixXd::Zero(system.columns(), system.columns());
    VectorXd all_right = VectorXd::Zero(system.columns());
    const auto add = [&](const std::vector<Index>& rows, double sign, MatrixXd& gram, VectorXd& right) {
      const MatrixXd x = system.x()(rows, Eigen::all);
      const MatrixXd weighted = weight(rows).asDiagonal() * x;
      gram.noalias() += sign * (x.transpose() * weighted);
      right.noalias() += sign * (weighted.transpose() * y(rows));
    };
    add(used, 1, all, all_right);
    for (std::size_t b = 0; b < kFolds; ++b) {
      const std::size_t from = used.size() * b / kFolds;
      const std::size_t to = used.size() * (b + 1) / kFolds;
      std::vector<Index> rows(used.begin() + static_cast<std::ptrdiff_t>(from),
                              used.begin() + static_cast<std::ptrdiff_t>(to));
      std::vector<Index> out;
      for (const Index k : used) {
        if (k >= rows.front() - guard && k <= rows.back() + guard) out.push_back(k);
      }
      Block block{all, all_right, system.x()(rows, Eigen::all), y(rows), weight(rows)};
      add(out, -1, block.gram, block.right);
      blocks_.push_back(std::move(block));
    }
  }

  double error_deg(const MatrixXd& penalty) const {
    double squares = 0;
    double count = 0;
    for (const Block& block : blocks_) {
      const VectorXd w = (block.gram + penalty).ldlt().solve(block.right);
      const VectorXd e = block.x * w - block.y;
      squares += e.cwiseAbs2().dot(block.weight);
      count += block.weight.sum();
    }
    return std::sqrt(squares / count);
  }

 private:
  std::vector<Block> blocks_;
};

// Each searched along its own axis in steps of a factor, from coarse to fine; those that the branches have.
template <class Error>
std::pair<Priors, double> best_priors(const Branches& branches, const Error& error) {
  std::vector<double Priors::*> axes = {&Priors::smooth};
  if (!branches.radii.empty()) axes.push_back(&Priors::plays);
  if (!branches.lags_s.empty()) axes.push_back(&Priors::motion);
  Priors best;
  double least = error(best);
  for (const double factor : {10.0, 10.0, 3.0}) {
    for (double Priors::*which : axes) {
      for (const double step : {factor, 1 / factor}) {
        for (;;) {
          Priors next = best;
          next.*which *= step;
          if (next.*which > 1e4 || next.*which < 1e-2) break;
          const double e = error(next);
          if (!(e < least)) break;
          least = e;
          best = next;
        }
      }
    }
  }
  return {best, least};
}

struct First {
  VectorXd weight;  // of every row
  double variance = 1;
};

// Weights and the size of the residuals, from the plain curve.
First first_fit(const Stack& stack, double period_s) {
  const Branches plain{{}, {}, 12};
  const System system(stack, plain, period_s);
  First out{VectorXd::Ones(stack.angle.size()), 1};
  const VectorXd y = (stack.angle.array() - stack.mean).matrix();
  const MatrixXd x = system.x()(stack.used, Eigen::all);
  for (int round = 0; round < 5; ++round) {
    const MatrixXd weighted = out.weight(stack.used).asDiagonal() * x;
    const VectorXd w = (x.transpose() * weighted + system.penalty({1, 1}, out.variance))
                           .ldlt()
                           .solve(weighted.transpose() * y(stack.used));
    const VectorXd e = system.x() * w - y;
    const double scale = std::max(robust_deviation(e(stack.used)), 1e-3);
    for (Index k = 0; k < e.size(); ++k)
      out.weight(k) = std::min(1.0, kHuber * scale / std::max(std::abs(e(k)), 1e-12));
    out.variance = scale * scale;
  }
  return out;
}

// By orthogonal factors of samples and priors together.
void solve(const System& system, const Stack& stack, const First& first, Additive& out) {
  const MatrixXd penalty = system.penalty(out.priors, first.variance);
  const MatrixXd root = penalty.llt().matrixU();
  const VectorXd scale = first.weight(stack.used).cwiseSqrt();
  const auto rows = static_cast<Index>(stack.used.size());
  MatrixXd a(rows + system.columns(), system.columns());
  a << MatrixXd(scale.asDiagonal() * system.x()(stack.used, Eigen::all)), root;
  VectorXd b = VectorXd::Zero(a.rows());
  b.head(rows) = scale.cwiseProduct((stack.angle(stack.used).array() - stack.mean).matrix());
  const Eigen::HouseholderQR<MatrixXd> qr(a);
  const VectorXd w = qr.solve(b);
  const VectorXd diagonal = qr.matrixQR().diagonal().cwiseAbs();
  out.condition = diagonal.maxCoeff() / diagonal.minCoeff();
  const MatrixXd r = qr.matrixQR().topRows(system.columns()).triangularView<Eigen::Upper>();
  const MatrixXd prior_share = r.transpose().triangularView<Eigen::Lower>().solve(root.transpose());
  out.effective = static_cast<double>(system.columns()) - prior_share.squaredNorm();
  const VectorXd e =
      system.x()(stack.used, Eigen::all) * w - (stack.angle(stack.used).array() - stack.mean).matrix();
  out.fitted_rmse_deg = std::sqrt(e.squaredNorm() / static_cast<double>(rows));
  out.samples = static_cast<int>(rows);
  out.offset_deg = stack.mean;
  const int knots = out.branches.knots;
  out.value = Eigen::Map<const MatrixXd>(w.data(), knots, system.columns() / knots);
  const VectorXd angle = stack.angle(stack.used);
  const double span = angle.maxCoeff() - angle.minCoeff();
  out.lower_deg = angle.minCoeff() - kMargin * span;
  out.upper_deg = angle.maxCoeff() + kMargin * span;
}

Additive fit_one(const Stack& stack, const First& first, const Branches& branches, double period_s,
                 const Drift& drift, double most_drift_deg) {
  const System system(stack, branches, period_s);
  Additive out;
  out.branches = branches;
  out.knots = system.knots();
  out.radii = system.radii();
  const CrossValidation validation(system, stack, first.weight, period_s);
  const auto error = [&](const Priors& priors) {
    return validation.error_deg(system.penalty(priors, first.variance));
  };
  std::tie(out.priors, out.cross_validated_deg) = best_priors(branches, error);
  for (int tries = 0; tries < kShrinks; ++tries) {
    solve(system, stack, first, out);
    out.hold_drift_deg = drift(out);
    if (branches.lags_s.empty() || out.hold_drift_deg <= most_drift_deg) break;
    out.priors.motion *= 3;
    out.cross_validated_deg = error(out.priors);
  }
  return out;
}

}  // namespace

std::string describe(const Branches& b) {
  std::string out = fmt::format("curves of {} knots", b.knots);
  if (!b.radii.empty()) out += fmt::format(", {} plays", b.radii.size());
  if (!b.lags_s.empty()) out += fmt::format(", motion over {} s", fmt::join(b.lags_s, " and "));
  return out;
}

std::vector<Additive> fit_additive(const std::vector<Session>& sessions, double period_s,
                                   const std::string& joint, const Drift& drift, double most_drift_deg,
                                   const Step& step) {
  const Stack stack(sessions);
  if (std::ssize(stack.used) < kLeastSamples) {
    throw io::JobError(fmt::format("{}: {} samples to fit, at least {} are needed: record longer", joint,
                                   stack.used.size(), kLeastSamples));
  }
  const VectorXd angle = stack.angle(stack.used);
  if (!(angle.maxCoeff() > angle.minCoeff()))
    throw io::JobError(fmt::format("{}: its angle never changes", joint));
  for (Index s = 0; s < stack.input.cols(); ++s) {
    if (!(range_of(stack, s).width() > 0))
      throw io::JobError(fmt::format("{}: a sensor never changes", joint));
  }
  const First first = first_fit(stack, period_s);
  std::vector<Additive> out;
  const std::vector<Branches> all = candidates(stack.input.cols());
  for (const Branches& branches : all) {
    if (step && !step(out.size(), all.size(), fmt::format("{}: {}", joint, describe(branches)))) {
      throw io::Cancelled("cancelled");
    }
    out.push_back(fit_one(stack, first, branches, period_s, drift, most_drift_deg));
  }
  double best = std::numeric_limits<double>::infinity();
  for (const Additive& one : out) best = std::min(best, one.cross_validated_deg);
  std::ranges::stable_sort(out, {}, [&](const Additive& one) {
    const bool as_good = one.cross_validated_deg <= (1 + kAsGood) * best;
    return std::pair(as_good ? static_cast<double>(one.value.size()) : 1e9, one.cross_validated_deg);
  });
  return out;
}

void add_to(model::Model& model, const Additive& fit, const std::vector<std::string>& inputs,
            const std::string& joint) {
  model::Sum sum;
  sum.offset = fit.offset_deg;
  std::vector<std::string> terms;
  const auto add = [&](const std::string& from, const std::string& to, model::Kind kind) {
    model.blocks.push_back({{from}, to, std::move(kind)});
    return to;
  };
  const auto curve = [&](std::size_t sensor, const VectorXd& y) {
    return model::Curve{fit.knots[sensor], {y.begin(), y.end()}};
  };
  const auto term = [&](const std::string& signal, double weight) {
    terms.push_back(signal);
    sum.weights.push_back(weight);
  };
  const int per_sensor = fit.branches_per_sensor();
  const auto radii = static_cast<int>(fit.branches.radii.size());
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    const auto value = fit.value.middleCols(static_cast<Index>(s) * per_sensor, per_sensor);
    const std::string name = inputs.size() > 1 ? fmt::format("{} {}", joint, inputs[s]) : joint;
    // f(u) - H f(u): its first part joins the curve of the reading itself.
    const VectorXd still = value.col(0) + value.rightCols(per_sensor - 1 - radii).rowwise().sum();
    term(add(inputs[s], name + " curve", curve(s, still)), 1);
    for (int r = 0; r < radii; ++r) {
      const double radius = fit.radii[s][static_cast<std::size_t>(r)];
      const std::string p = add(inputs[s], fmt::format("{} play {}", name, r + 1), model::Play{radius});
      term(add(p, fmt::format("{} curve {}", name, r + 1), curve(s, value.col(1 + r))), 1);
    }
    for (std::size_t l = 0; l < fit.branches.lags_s.size(); ++l) {
      const VectorXd y = value.col(1 + radii + static_cast<Index>(l));
      const std::string c = add(inputs[s], fmt::format("{} motion {}", name, l + 1), curve(s, y));
      term(add(c, fmt::format("{} lag {}", name, l + 1), model::Lag{1 / fit.branches.lags_s[l]}), -1);
    }
  }
  const std::string total = joint + " sum";
  model.blocks.push_back({terms, total, sum});
  add(total, joint + " angle", model::Saturation{fit.lower_deg, fit.upper_deg});
  model.joints.push_back({joint, joint + " angle", fit.offset_deg});
}

}  // namespace flexor::identify
