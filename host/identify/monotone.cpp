// The prior that a sensor's angle does not turn back.
//
// Of one sensor, from a turn on while more and more plays begin to move: the angle goes on rising or falling with the reading, but
// where it goes back by more than ten standard errors, which is beyond doubt. Where it goes back by less it may not,
// which is the quadratic programme
//   min_w (w - free)' (gram + penalty) (w - free),   gain w >= 0 there.
// Solved by its dual. A way back is judged as a whole: it is sure where any part of it is. The
// smoothness of the curves is in the error (B. Silverman, JRSS B 47 (1985) 1), in the scale of the bootstrap.
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>

#include "host/identify/additive_system.hpp"
#include "host/io/numbers.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDoubt = 10;  // standard errors

// What the angle gains from point to point of a reading that goes up (sign 1) or down (-1) slowly, `plays` of the plays moving
// with it: row by row, of the coefficients. Between two points all curves are straight.
MatrixXd gains(const Additive& fit, std::size_t plays, double sign, Index columns) {
  const std::vector<double>& knots = fit.knots.front();
  std::vector<double> at = knots;
  for (std::size_t p = 0; p < plays; ++p)
    for (const double knot : knots) at.push_back(knot + sign * fit.radii.front()[p]);
  std::erase_if(at, [&](double u) { return u < knots.front() || u > knots.back(); });
  std::ranges::sort(at);
  const auto add = [&](std::size_t branch, double u, double share, auto row) {
    const auto [k, on] = io::place(knots, u);
    const auto column = static_cast<Index>(branch * knots.size()) + k;
    row(column) += share * (1 - on);
    row(column + 1) += share * on;
  };
  MatrixXd out = MatrixXd::Zero(std::ssize(at) - 1, columns);
  for (Index i = 0; i < out.rows(); ++i) {
    for (std::size_t b = 0; b <= plays; ++b) {
      const double behind = b == 0 ? 0 : sign * fit.radii.front()[b - 1];
      add(b, at[static_cast<std::size_t>(i) + 1] - behind, sign, out.row(i));
      add(b, at[static_cast<std::size_t>(i)] - behind, -sign, out.row(i));
    }
  }
  return sign > 0 ? out : MatrixXd(out.colwise().reverse());
}

// Ways through the readings, one below the other.
struct Ways {
  MatrixXd gain;             // from point to point; negative: back
  std::vector<Index> begin;  // of each, and the end
};

Ways ways_of(const Additive& fit, Index columns) {
  const auto total = [&](Index k) {
    return fit.value.row(k).head(static_cast<Index>(fit.branches.still())).sum();
  };
  // Not by the outermost knots, beyond any reading.
  const double direction = total(fit.value.rows() - 2) > total(1) ? 1 : -1;
  Ways out{MatrixXd(0, columns), {}};
  for (std::size_t plays = 0; plays < fit.branches.still(); ++plays) {
    for (const double sign : {1.0, -1.0}) {
      if (plays == 0 && sign < 0) continue;
      const MatrixXd way = sign * direction * gains(fit, plays, sign, columns);
      out.begin.push_back(out.gain.rows());
      out.gain.conservativeResize(out.gain.rows() + way.rows(), Eigen::NoChange);
      out.gain.bottomRows(way.rows()) = way;
    }
  }
  out.begin.push_back(out.gain.rows());
  return out;
}

// Of each step whether its going back, if it does, is in doubt. `error` is that of a sum of steps.
std::vector<bool> doubts(const Ways& ways, const VectorXd& gain,
                         const std::function<double(const VectorXd&)>& error) {
  std::vector<bool> out(static_cast<std::size_t>(gain.size()), true);
  for (Index from = 0; from < gain.size(); ++from) {
    if (gain(from) >= 0) continue;
    const Index end = *std::ranges::upper_bound(ways.begin, from);
    Index to = from + 1;
    while (to < end && gain(to) < 0) ++to;
    const auto sure = [&](Index first, Index last) {
      VectorXd part = VectorXd::Zero(gain.size());
      part.segment(first, last + 1 - first).setOnes();
      return -part.dot(gain) > kDoubt * error(part);
    };
    bool any = false;
    for (Index first = from; first < to; ++first) {
      for (Index last = first; last < to && !any; ++last) any = sure(first, last);
    }
    if (any) std::fill(out.begin() + from, out.begin() + to, false);
    from = to - 1;
  }
  return out;
}

// min_x x'Dx / 2 - b'x, x >= 0; D positive semidefinite (C. Lawson, R. Hanson, Solving Least Squares Problems, 1974, 23.3).
VectorXd nonnegative(const MatrixXd& d, const VectorXd& b) {
  const double least = 1e-9 * b.cwiseAbs().maxCoeff();
  VectorXd x = VectorXd::Zero(b.size());
  std::vector<Index> free;
  for (Index step = 0; step < 3 * b.size(); ++step) {
    VectorXd slope = b - d * x;
    slope(free).setZero();
    Index most = 0;
    if (!(slope.maxCoeff(&most) > least)) break;
    free.push_back(most);
    while (!free.empty()) {
      const VectorXd to = MatrixXd(d(free, free)).completeOrthogonalDecomposition().solve(b(free));
      const VectorXd at = x(free);
      double share = 1;
      for (Index k = 0; k < to.size(); ++k)
        if (to(k) <= 0) share = std::min(share, at(k) / (at(k) - to(k)));
      x(free) = at + share * (to - at);
      if (share == 1) break;
      std::erase_if(free, [&](Index k) {
        const bool gone = x(k) <= 1e-12 * x.maxCoeff();
        if (gone) x(k) = 0;
        return gone;
      });
    }
  }
  return x;
}

}  // namespace

void make_monotone(const MatrixXd& gram, const MatrixXd& penalty, Additive& fit) {
  if (fit.knots.size() > 1 || fit.branches.knots == 2) return;
  const Ways ways = ways_of(fit, gram.cols());
  const VectorXd free = fit.coefficients();
  const MatrixXd all = gram.selfadjointView<Eigen::Lower>();
  const MatrixXd spread = MatrixXd(all + penalty).llt().solve(ways.gain.transpose());
  const MatrixXd known = ways.gain.leftCols(fit.value.size());
  const auto error = [&](const VectorXd& steps) {
    const VectorXd of = known.transpose() * steps;
    const VectorXd moved = spread * steps;
    return std::sqrt(of.dot(fit.covariance * of) / moved.dot(all * moved) *
                     (ways.gain.transpose() * steps).dot(moved));
  };
  const VectorXd gain = ways.gain * free;
  const std::vector<bool> doubtful = doubts(ways, gain, error);
  std::vector<Index> kept;
  for (Index k = 0; k < gain.size(); ++k)
    if (doubtful[static_cast<std::size_t>(k)]) kept.push_back(k);
  if (kept.empty() || gain(kept).minCoeff() >= 0) return;
  const MatrixXd moves = spread(Eigen::all, kept);
  fit.set_coefficients(free + moves * nonnegative(ways.gain(kept, Eigen::all) * moves, -gain(kept)),
                       fit.value.size());
}

}  // namespace flexor::identify
