#include "host/identify/additive_system.hpp"

#include <cmath>

#include "host/identify/levenberg_marquardt.hpp"
#include "host/identify/robust.hpp"
#include "host/io/numbers.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr Index kMostRows = 20000;  // neighbouring samples tell the same
constexpr double kBeyond = 0.25;    // knots beyond the readings, as a share of their range
constexpr double kAnchor = 1e-5;    // prior weight of all values: only where nothing tells them
constexpr double kStraight = 1;     // prior weight of a bend at the outermost knots
constexpr double kEnd_deg = 1;      // nearer to a limit than this, the finger rests at its end
constexpr double kGoesOn =
    0.05;  // of the readings' range: at a limit the sensor goes on, in a held pose it does not
constexpr double kRests = 0.05;    // of the time: an end that it is less at is a pose like others
constexpr double kDonning = 0.03;  // standard deviation of a reading from donning to donning, in ranges
constexpr double kShort_s = 20;    // of a recording as short as this a donning counts half
constexpr double kMotion = 30;     // how much smoother a motion's curve is than a reading's
constexpr double kCommon = 1e5;    // prior weight of what all donnings share: that is the curves'
constexpr double kTail = 0.002;    // share of the readings outside the knots' range
constexpr double kMixSmooth = 10;  // priors of the curve and the weights of a mix
constexpr double kMixPrior = 1e-3;
constexpr double kMixMotion_s = 0.1;
constexpr int kMixKnots = 12;
constexpr int kMixRounds = 3;
constexpr double kGrid = 1.0 / 32;  // knots lie on the steps of Q5 where the readings are that coarse

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
  if (range > 100 * kGrid * count)
    for (double& x : out) x = std::round(x / kGrid) * kGrid;
  return out;
}

MatrixXd hat_values(const VectorXd& u, const std::vector<double>& knots) {
  MatrixXd out = MatrixXd::Zero(u.size(), std::ssize(knots));
  for (Index k = 0; k < u.size(); ++k) {
    const auto [i, share] = io::place(knots, u(k));
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
    for (std::size_t k = 0; k < s.use.size(); ++k)
      if (s.use[k]) all.push_back(at + static_cast<Index>(k));
    at += s.angle_deg.size();
  }
  begin.push_back(rows);
  const Index every = 1 + (std::ssize(all) - 1) / kMostRows;
  for (Index k = 0; k < std::ssize(all); k += every) used.push_back(all[static_cast<std::size_t>(k)]);
}

namespace {

model::Saturation quantiles(const VectorXd& angle, double tail) {
  const std::vector<double> all = sorted(angle);
  return {quantile(all, tail), quantile(all, 1 - tail)};
}

}  // namespace

model::Saturation limits_of(const Stack& stack, double tail) {
  return quantiles(stack.angle(stack.used), tail);
}

model::Saturation open_limits(const VectorXd& angle) {
  const double span_deg = angle.maxCoeff() - angle.minCoeff();
  return {angle.minCoeff() - span_deg, angle.maxCoeff() + span_deg};
}

model::Saturation limits_at_rest(const VectorXd& angle, const VectorXd& own, double beyond) {
  const model::Saturation ends = quantiles(angle, kEnds);
  const double beyond_deg = beyond * (angle.maxCoeff() - angle.minCoeff());
  const auto rests = [&](const auto& is_there) {
    std::vector<double> there;
    for (Index k = 0; k < angle.size(); ++k)
      if (is_there(angle(k))) there.push_back(own(k));
    if (static_cast<double>(there.size()) <= kRests * static_cast<double>(angle.size())) return false;
    std::ranges::sort(there);
    return quantile(there, 0.95) - quantile(there, 0.05) > kGoesOn * (own.maxCoeff() - own.minCoeff());
  };
  const bool low = rests([&](double y) { return y < ends.lower_deg + kEnd_deg; });
  const bool high = rests([&](double y) { return y > ends.upper_deg - kEnd_deg; });
  return {low ? ends.lower_deg : angle.minCoeff() - beyond_deg,
          high ? ends.upper_deg : angle.maxCoeff() + beyond_deg};
}

double range_of(const Stack& stack, Index sensor) {
  const std::vector<double> u = sorted(stack.input(stack.used, sensor));
  return quantile(u, 1 - kTail) - quantile(u, kTail);
}

namespace {

// What a mix is fitted to: readings in standard deviations, still and in motion, and angles about their median.
struct MixData {
  MatrixXd still;
  MatrixXd moving;
  VectorXd angle;
  std::vector<Index> recording;
};

// Residuals of the used samples, then of the priors. Of what is searched: weights, the curve's values on these knots, the motion, and
// the level of each recording.
VectorXd mix_residual(const MixData& data, const VectorXd& line, const std::vector<double>& knots,
                      const VectorXd& at, MatrixXd* jacobian) {
  const Index n = data.angle.size();
  const Index m = line.size();
  const Index motion = m + kMixKnots;
  const VectorXd u = data.still * at.head(m);
  MatrixXd j = MatrixXd::Zero(n + kMixKnots - 1 + at.size(), at.size());
  j.block(0, m, n, kMixKnots) = hat_values(u, knots);
  j.col(motion).head(n) = data.moving * at.head(m);
  for (Index k = 0; k < n; ++k) j(k, motion + data.recording[static_cast<std::size_t>(k)]) = 1;
  j.block(n, m, kMixKnots - 2, kMixKnots) = std::sqrt(kMixSmooth) * second_differences(knots);
  j.bottomRows(at.size()).diagonal().setConstant(std::sqrt(kAnchor));
  j.bottomRows(at.size()).diagonal().tail(at.size() - motion - 1).setOnes();
  VectorXd r = j * at;
  // The curve takes up any other size of the weights.
  j.row(n + kMixKnots - 2).head(m) = line.transpose();
  r(n + kMixKnots - 2) = line.dot(at.head(m) - line);
  for (Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(io::place(knots, u(k)).first);
    const auto low = m + static_cast<Index>(i);
    j.row(k).head(m) = (at(low + 1) - at(low)) / (knots[i + 1] - knots[i]) * data.still.row(k) +
                       at(motion) * data.moving.row(k);
    const Bent bent = bend(r(k) - data.angle(k), kLoss_deg);
    r(k) = bent.value;
    j.row(k) *= bent.slope;
  }
  if (jacobian != nullptr) *jacobian = std::move(j);
  return r;
}

}  // namespace

VectorXd mix_of(const Stack& stack, double period_s) {
  const MatrixXd used = stack.input(stack.used, Eigen::all);
  const auto n = static_cast<double>(used.rows());
  const Eigen::RowVectorXd mean = used.colwise().mean();
  const VectorXd deviation = ((used.rowwise() - mean).colwise().squaredNorm() / n).cwiseSqrt();
  Stack mixed = stack;
  mixed.input = (stack.input.rowwise() - mean) * deviation.cwiseInverse().asDiagonal();
  MixData data{mixed.input(stack.used, Eigen::all),
               motion(stack, kMixMotion_s, period_s, mixed.input)(stack.used, Eigen::all),
               stack.angle(stack.used),
               {}};
  data.angle.array() -= median({data.angle.begin(), data.angle.end()});
  for (const Index k : stack.used)
    data.recording.push_back(std::ranges::upper_bound(stack.begin, k) - stack.begin.begin());
  MatrixXd squares = data.still.transpose() * data.still;
  squares.diagonal().array() += kMixPrior * n;
  VectorXd line = squares.llt().solve(data.still.transpose() * data.angle);
  for (int round = 0; round < kMixRounds; ++round) {
    const VectorXd u = data.still * line;
    line /= u.norm() / std::sqrt(n);
    const std::vector<double> knots = knots_of(sorted(data.still * line), kMixKnots);
    VectorXd x = VectorXd::Zero(line.size() + kMixKnots + std::ssize(stack.begin));
    x.head(line.size()) = line;
    x.segment(line.size(), kMixKnots) =
        u.dot(data.angle) / u.norm() / std::sqrt(n) * Eigen::Map<const VectorXd>(knots.data(), kMixKnots);
    const VectorXd far = VectorXd::Constant(x.size(), HUGE_VAL);
    levenberg_marquardt(
        [&](const VectorXd& at, MatrixXd* jacobian) { return mix_residual(data, line, knots, at, jacobian); },
        -far, far, {}, x);
    line = x.head(line.size());
  }
  if ((data.still * line).dot(data.still.col(0)) < 0) line = -line;
  mixed.input *= line;
  return range_of(stack, 0) / range_of(mixed, 0) * line.cwiseQuotient(deviation);
}

System::System(const Stack& stack, const Branches& branches, double period_s, const model::Saturation& ends) {
  for (Index s = 0; s < stack.input.cols(); ++s) {
    const std::vector<double> u = sorted(stack.input(stack.used, s));
    knots_.push_back(knots_of(u, branches.knots));
    radii_.emplace_back();
    const double range = range_of(stack, s);
    for (const double share : branches.radii) radii_.back().push_back(share * range);
  }
  const Donnings donnings(ends, stack, period_s);
  make_rows(stack, donnings);
  fill(stack, branches, donnings, period_s);
  fill_donnings(stack);
  make_penalties(branches);
}

// From the donnings that were recorded to the next one.
Donnings::Donnings(model::Saturation of, const Stack& stack, double period_s)
    : ends(of),
      sensors(static_cast<double>(stack.input.cols())),
      spread(std::max(3.0, sensors)),
      step(std::sqrt(spread) * kDonning * std::sqrt(1 + 1 / (static_cast<double>(stack.begin.size()) - 1))) {
  const double length_s = period_s * static_cast<double>(stack.angle.size());
  share = length_s / (length_s + kShort_s);
}

bool Donnings::tells(double angle_deg) const {
  return angle_deg < ends.lower_deg + kEnd_deg || angle_deg > ends.upper_deg - kEnd_deg;
}

void System::make_rows(const Stack& stack, const Donnings& donnings) {
  const Index sensors = stack.input.cols();
  std::vector<double> weights;
  std::vector<double> angles;
  std::vector<double> original;
  const auto add = [&](double angle, double weight, bool real) {
    angles.push_back(angle);
    weights.push_back(weight);
    original.push_back(real ? 1 : 0);
  };
  for (const Index k : stack.used) {
    first_.push_back(std::ssize(angles));
    const double angle = stack.angle(k);
    const bool at_end = donnings.tells(angle);
    add(angle, at_end ? donnings.original() : 1, true);
    for (Index s = 0; at_end && s < 2 * sensors; ++s) add(angle, donnings.shifted(), false);
  }
  const Index rows = std::ssize(angles);
  first_.push_back(rows);
  angle_ = Eigen::Map<const VectorXd>(angles.data(), rows);
  weight_ = Eigen::Map<const VectorXd>(weights.data(), rows);
  original_ = Eigen::Map<const VectorXd>(original.data(), rows);
}

void System::fill(const Stack& stack, const Branches& branches, const Donnings& of, double period_s) {
  const Index sensors = stack.input.cols();
  const Index knots = branches.knots;
  const Index rows = first_.back();
  const auto lags = std::ssize(branches.lags_s);
  hats_per_row_ = knots_.size() * branches.still();
  still_columns_ = static_cast<Index>(hats_per_row_) * knots;
  still_.resize(static_cast<std::size_t>(rows) * hats_per_row_);
  const auto donnings = static_cast<Index>(stack.begin.size()) - 1;
  donning_columns_ = donnings > 1 ? donnings * (1 + sensors) : 0;
  dense_ = Matrix::Zero(rows, sensors * lags * knots + donning_columns_);
  for (Index s = 0; s < sensors; ++s) {
    const auto own = static_cast<std::size_t>(s);
    const double step = of.step * (knots_[own].back() - knots_[own].front()) / (1 + 2 * kBeyond);
    for (const double shift : {0.0, -step, step}) {
      // Where the sample as it was and those of the other sensors' shifts have the same columns.
      const auto put = [&](const auto& into_row) {
        for (std::size_t k = 0; k < stack.used.size(); ++k) {
          if (shift == 0) {
            for (Index r = first_[k]; r < first_[k + 1]; ++r) into_row(r, stack.used[k]);
          } else if (first_[k + 1] - first_[k] > 1) {
            into_row(first_[k] + 1 + 2 * s + (shift > 0 ? 1 : 0), stack.used[k]);
          }
        }
      };
      const VectorXd u = (stack.input.col(s).array() + shift).matrix();
      std::size_t branch = own * branches.still();
      const auto put_still = [&](const VectorXd& x) {
        put([&](Index row, Index sample) {
          const auto [i, share] = io::place(knots_[own], x(sample));
          still_[static_cast<std::size_t>(row) * hats_per_row_ + branch] = {
              static_cast<Index>(branch) * knots + i, share};
        });
        ++branch;
      };
      put_still(u);
      for (const double radius : radii_[own]) put_still(play(stack, u, radius));
      if (lags == 0) continue;
      const MatrixXd still = hat_values(u, knots_[own]);
      for (Index l = 0; l < lags; ++l) {
        const MatrixXd moving = motion(stack, branches.lags_s[static_cast<std::size_t>(l)], period_s, still);
        put([&](Index row, Index sample) {
          dense_.row(row).segment((s * lags + l) * knots, knots) = moving.row(sample);
        });
      }
    }
  }
}

void System::fill_donnings(const Stack& stack) {
  if (donning_columns_ == 0) return;
  for (std::size_t k = 0; k < stack.used.size(); ++k) {
    const Index donning = std::ranges::upper_bound(stack.begin, stack.used[k]) - stack.begin.begin() - 1;
    const Index at = dense_.cols() - donning_columns_ + donning * (1 + stack.input.cols());
    for (Index r = first_[k]; r < first_[k + 1]; ++r) {
      dense_(r, at) = 1;
      for (std::size_t s = 0; s < knots_.size(); ++s) {
        const double middle = (knots_[s].back() + knots_[s].front()) / 2;
        const double half = (knots_[s].back() - knots_[s].front()) / 2 / (1 + 2 * kBeyond);
        dense_(r, at + 1 + static_cast<Index>(s)) =
            (stack.input(stack.used[k], static_cast<Index>(s)) - middle) / half;
      }
    }
  }
}

MatrixXd System::x() const {
  MatrixXd out = MatrixXd::Zero(rows(), columns());
  out.rightCols(dense_.cols()) = dense_;
  for (Index r = 0; r < rows(); ++r) {
    for (std::size_t h = 0; h < hats_per_row_; ++h) {
      const Hat& hat = hats(r)[h];
      out(r, hat.column) = 1 - hat.share;
      out(r, hat.column + 1) = hat.share;
    }
  }
  return out;
}

VectorXd System::estimate(Index from, Index count, const VectorXd& coefficients) const {
  VectorXd out = dense_.middleRows(from, count) * coefficients.tail(dense_.cols());
  for (Index r = 0; r < count; ++r) {
    for (std::size_t h = 0; h < hats_per_row_; ++h) {
      const Hat& hat = hats(from + r)[h];
      out(r) += (1 - hat.share) * coefficients(hat.column) + hat.share * coefficients(hat.column + 1);
    }
  }
  return out;
}

VectorXd System::project(Index from, const VectorXd& values) const {
  VectorXd out = VectorXd::Zero(columns());
  out.tail(dense_.cols()) = dense_.middleRows(from, values.size()).transpose() * values;
  for (Index r = 0; r < values.size(); ++r) {
    for (std::size_t h = 0; h < hats_per_row_; ++h) {
      const Hat& hat = hats(from + r)[h];
      out(hat.column) += (1 - hat.share) * values(r);
      out(hat.column + 1) += hat.share * values(r);
    }
  }
  return out;
}

void System::add_gram(Index from, const VectorXd& weight, double sign, MatrixXd& gram) const {
  const Index moving = dense_.cols();
  // Columns of the motion below, row-major: a hat's share of a row is a row's worth of additions.
  Matrix mixed = Matrix::Zero(still_columns_, moving);
  for (Index r = 0; r < weight.size(); ++r) {
    const Hat* row = hats(from + r);
    const double w = sign * weight(r);
    for (std::size_t a = 0; a < hats_per_row_; ++a) {
      const double low = w * (1 - row[a].share);
      const double high = w * row[a].share;
      const Index at = row[a].column;
      gram(at, at) += low * (1 - row[a].share);
      gram(at + 1, at) += low * row[a].share;
      gram(at + 1, at + 1) += high * row[a].share;
      for (std::size_t b = 0; b < a; ++b) {
        const Index left = row[b].column;
        gram(at, left) += low * (1 - row[b].share);
        gram(at, left + 1) += low * row[b].share;
        gram(at + 1, left) += high * (1 - row[b].share);
        gram(at + 1, left + 1) += high * row[b].share;
      }
      mixed.row(at) += low * dense_.row(from + r);
      mixed.row(at + 1) += high * dense_.row(from + r);
    }
  }
  if (moving == 0) return;
  gram.bottomLeftCorner(moving, still_columns_) += mixed.transpose();
  const VectorXd root = weight.cwiseSqrt();
  const Matrix scaled = root.asDiagonal() * dense_.middleRows(from, weight.size());
  gram.bottomRightCorner(moving, moving).selfadjointView<Eigen::Lower>().rankUpdate(scaled.transpose(), sign);
}

void System::make_penalties(const Branches& branches) {
  smooth_ = MatrixXd::Zero(columns(), columns());
  straight_ = smooth_;
  plays_ = VectorXd::Zero(columns());
  motion_ = VectorXd::Zero(columns());
  motion_.segment(still_columns_, shared_columns() - still_columns_).setOnes();
  donning_ = VectorXd::Zero(columns());
  donning_.tail(donning_columns_).setOnes();
  common_ = MatrixXd::Zero(columns(), columns());
  const Index per_donning = 1 + std::ssize(knots_);
  const Index donnings = donning_columns_ / per_donning;
  for (Index a = shared_columns(); a < columns(); ++a) {
    for (Index b = shared_columns() + (a - shared_columns()) % per_donning; b < columns(); b += per_donning)
      common_(a, b) = 1 / static_cast<double>(donnings);
  }
  const Index n = branches.knots;
  const Index still = still_columns_ / n;
  for (Index b = 0; b < shared_columns() / n; ++b) {
    const Index per_sensor = b < still ? static_cast<Index>(branches.still()) : std::ssize(branches.lags_s);
    const Index own = b < still ? b : b - still;
    const MatrixXd bend = second_differences(knots_[static_cast<std::size_t>(own / per_sensor)]);
    smooth_.block(b * n, b * n, n, n) = (b < still ? 1 : kMotion) * bend.transpose() * bend;
    // Into where nothing was read, each curve goes on straight.
    for (const Index end : {Index{0}, bend.rows() - 1})
      if (bend.rows() > 0) straight_.block(b * n, b * n, n, n) += bend.row(end).transpose() * bend.row(end);
    if (b < still && own % per_sensor > 0) plays_.segment(b * n, n).setOnes();
  }
}

MatrixXd System::penalty(const Priors& priors) const {
  MatrixXd out = priors.smooth * smooth_ + kStraight * straight_ + kCommon * common_;
  out.diagonal() += priors.plays * plays_ + priors.motion * motion_ + priors.donning * donning_;
  out.diagonal().array() += kAnchor;
  return out;
}

}  // namespace flexor::identify
