#include "host/identify/additive_system.hpp"

#include <algorithm>
#include <cmath>

#include "host/identify/robust.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMostRows = 20000;  // neighbouring samples tell the same
constexpr double kBeyond = 0.25;    // knots beyond the readings, as a share of their range
constexpr double kAnchor = 1e-5;    // prior weight of all values: only where nothing tells them
constexpr double kStraight = 1;     // prior weight of a bend at the outermost knots
constexpr double kEnd_deg = 1;      // nearer to a limit than this, the finger rests at its end
constexpr double kDonning = 0.03;   // standard deviation of a reading from donning to donning, in ranges
constexpr double kTail = 0.002;     // share of the readings outside the knots' range
constexpr double kGrid = 1.0 / 32;  // knots lie on the steps of Q5 where the readings are that coarse

std::vector<double> sorted(const VectorXd& values) {
  std::vector<double> out(values.begin(), values.end());
  std::ranges::sort(out);
  return out;
}

// Quantiles of the readings, apart from one another, and one knot beyond each end: there the smoothness carries
// the curve on straight. An outlier moves none.
std::vector<double> knots_of(const std::vector<double>& u, int count) {
  const double low = quantile(u, kTail);
  const double range = quantile(u, 1 - kTail) - low;
  if (count == 2) return {low - kBeyond * range, low + (1 + kBeyond) * range};
  const int inner = count - 2;
  const double least = range / (4 * inner);
  std::vector<double> out;
  for (int i = 0; i < inner; ++i) {
    // Half by where the readings are, half by where they could be.
    const double share = i / (inner - 1.0);
    const double at = 0.5 * quantile(u, kTail + share * (1 - 2 * kTail)) + 0.5 * (low + share * range);
    out.push_back(out.empty() ? at : std::max(at, out.back() + least));
  }
  out.insert(out.begin(), low - kBeyond * range);
  out.push_back(std::max(low + range, out.back()) + kBeyond * range);
  if (range > 100 * kGrid * count) {
    for (double& x : out) x = std::round(x / kGrid) * kGrid;
  }
  return out;
}

// Piecewise-linear interpolation: two hats for each reading.
MatrixXd hats(const VectorXd& u, const std::vector<double>& knots) {
  MatrixXd out = MatrixXd::Zero(u.size(), std::ssize(knots));
  for (Index k = 0; k < u.size(); ++k) {
    const double x = std::clamp(u(k), knots.front(), knots.back());
    const auto next = std::ranges::upper_bound(knots, x);
    const auto i = std::clamp<std::ptrdiff_t>(next - knots.begin() - 1, 0, std::ssize(knots) - 2);
    const auto at = static_cast<std::size_t>(i);
    const double share = (x - knots[at]) / (knots[at + 1] - knots[at]);
    out(k, i) = 1 - share;
    out(k, i + 1) = share;
  }
  return out;
}

VectorXd play(const Stack& stack, VectorXd out, double radius) {
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
MatrixXd motion(const Stack& stack, double lag_s, double period_s, MatrixXd x) {
  const double keep = std::exp(-period_s / lag_s);
  for (std::size_t s = 0; s + 1 < stack.begin.size(); ++s) {
    Eigen::RowVectorXd state = x.row(stack.begin[s]);
    for (Index k = stack.begin[s]; k < stack.begin[s + 1]; ++k) {
      state = keep * state + (1 - keep) * x.row(k);
      x.row(k) -= state;
    }
  }
  return x;
}

// Of slopes, scaled to the mean distance of the knots.
MatrixXd second_differences(const std::vector<double>& x) {
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

int count_of(const Branches& b) { return 1 + static_cast<int>(b.radii.size() + b.lags_s.size()); }

}  // namespace

Stack::Stack(const std::vector<Session>& sessions) {
  Index rows = 0;
  for (const Session& s : sessions) rows += s.angle_deg.size();
  input.resize(rows, sessions.front().input.cols());
  angle.resize(rows);
  std::vector<Index> all;
  Index at = 0;
  for (const Session& s : sessions) {
    begin.push_back(at);
    input.middleRows(at, s.angle_deg.size()) = s.input;
    angle.segment(at, s.angle_deg.size()) = s.angle_deg;
    for (std::size_t k = 0; k < s.use.size(); ++k) {
      if (s.use[k]) all.push_back(at + static_cast<Index>(k));
    }
    at += s.angle_deg.size();
  }
  begin.push_back(rows);
  const Index every = 1 + (std::ssize(all) - 1) / kMostRows;
  for (Index k = 0; k < std::ssize(all); k += every) used.push_back(all[static_cast<std::size_t>(k)]);
}

Limits limits_of(const Stack& stack, double tail) {
  const std::vector<double> angle = sorted(stack.angle(stack.used));
  return {quantile(angle, tail), quantile(angle, 1 - tail)};
}

System::System(const Stack& stack, const Branches& branches, double period_s, const Limits& ends) {
  for (Index s = 0; s < stack.input.cols(); ++s) {
    const std::vector<double> u = sorted(stack.input(stack.used, s));
    knots_.push_back(knots_of(u, branches.knots));
    radii_.emplace_back();
    const double range = quantile(u, 1 - kTail) - quantile(u, kTail);
    for (const double share : branches.radii) radii_.back().push_back(share * range);
  }
  make_rows(stack, ends);
  fill(stack, branches, period_s);
  make_penalties(branches);
}

// Sigma points: the sample as it was, then each sensor shifted down and up; they have the mean and the variance
// of donnings.
void System::make_rows(const Stack& stack, const Limits& ends) {
  const Index sensors = stack.input.cols();
  const double spread = std::max<double>(3, static_cast<double>(sensors));
  Index rows = 0;
  std::vector<double> weights;
  std::vector<double> angles;
  std::vector<double> as_it_was;
  const auto add = [&](double angle, double weight, bool real) {
    angles.push_back(angle);
    weights.push_back(weight);
    as_it_was.push_back(real ? 1 : 0);
    ++rows;
  };
  for (const Index k : stack.used) {
    first_.push_back(rows);
    const double angle = stack.angle(k);
    const bool at_end = angle < ends.lower + kEnd_deg || angle > ends.upper - kEnd_deg;
    add(angle, at_end ? 1 - static_cast<double>(sensors) / spread : 1, true);
    for (Index s = 0; at_end && s < 2 * sensors; ++s) add(angle, 1 / (2 * spread), false);
  }
  first_.push_back(rows);
  angle_ = Eigen::Map<const VectorXd>(angles.data(), rows);
  weight_ = Eigen::Map<const VectorXd>(weights.data(), rows);
  as_it_was_ = Eigen::Map<const VectorXd>(as_it_was.data(), rows);
}

void System::fill(const Stack& stack, const Branches& branches, double period_s) {
  const Index sensors = stack.input.cols();
  const Index knots = branches.knots;
  x_.resize(first_.back(), sensors * count_of(branches) * knots);
  // From those that were recorded to the next one.
  const double spread = kDonning * std::sqrt(1 + 1 / static_cast<double>(stack.begin.size() - 1));
  for (Index s = 0; s < sensors; ++s) {
    const auto own = static_cast<std::size_t>(s);
    const double range = knots_[own].back() - knots_[own].front();
    const double step =
        std::sqrt(std::max<double>(3, static_cast<double>(sensors))) * spread * range / (1 + 2 * kBeyond);
    for (const double shift : {0.0, -step, step}) {
      // Where the sample as it was and those of the other sensors' shifts have the same columns.
      const auto put = [&](Index branch, const MatrixXd& block) {
        const Index at = (s * count_of(branches) + branch) * knots;
        for (std::size_t k = 0; k < stack.used.size(); ++k) {
          const auto row = block.row(stack.used[k]);
          if (shift == 0) {
            for (Index r = first_[k]; r < first_[k + 1]; ++r) x_.row(r).segment(at, knots) = row;
          } else if (first_[k + 1] - first_[k] > 1) {
            x_.row(first_[k] + 1 + 2 * s + (shift > 0 ? 1 : 0)).segment(at, knots) = row;
          }
        }
      };
      const VectorXd u = (stack.input.col(s).array() + shift).matrix();
      const MatrixXd still = hats(u, knots_[own]);
      Index branch = 0;
      put(branch++, still);
      for (const double radius : radii_[own]) put(branch++, hats(play(stack, u, radius), knots_[own]));
      for (const double lag_s : branches.lags_s) put(branch++, motion(stack, lag_s, period_s, still));
    }
  }
}

void System::make_penalties(const Branches& branches) {
  smooth_ = MatrixXd::Zero(columns(), columns());
  straight_ = smooth_;
  plays_ = VectorXd::Zero(columns());
  motion_ = VectorXd::Zero(columns());
  const Index n = branches.knots;
  for (std::size_t s = 0; s < knots_.size(); ++s) {
    const MatrixXd bend = second_differences(knots_[s]);
    for (int b = 0; b < count_of(branches); ++b) {
      const Index at = (static_cast<Index>(s) * count_of(branches) + b) * n;
      smooth_.block(at, at, n, n) = bend.transpose() * bend;
      // Into where nothing was read, each curve goes on straight.
      for (const Index end : {Index{0}, bend.rows() - 1}) {
        if (bend.rows() > 0) straight_.block(at, at, n, n) += bend.row(end).transpose() * bend.row(end);
      }
      const bool moves = b > static_cast<int>(branches.radii.size());
      if (b > 0) (moves ? motion_ : plays_).segment(at, n).setOnes();
    }
  }
}

MatrixXd System::penalty(const Priors& priors) const {
  MatrixXd out = priors.smooth * smooth_ + kStraight * straight_;
  out.diagonal() += priors.plays * plays_ + priors.motion * motion_;
  out.diagonal().array() += kAnchor;
  return out;
}

}  // namespace flexor::identify
