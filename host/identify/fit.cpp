#include "host/identify/fit.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/identify/additive_system.hpp"
#include "host/identify/levenberg_marquardt.hpp"
#include "host/identify/robust.hpp"
#include "host/identify/structure_text.hpp"
#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kSamplesPerParameter = 5;
constexpr double kRobustScale = 2.5;
constexpr double kMaxPlayWeight = 4;
constexpr double kMaxTap = 8;
constexpr double kLeastDamping = 0.02;  // within what a board's block takes
constexpr double kMostDamping = 0.99;
constexpr double kSaturatedMargin = 0.08;
constexpr double kSlowestPerRecording = 10;
constexpr double kRankTolerance = 1e-7;
constexpr Index kMaxLags = 400;
// Standard errors beyond which a value says nothing: a pole within a factor of e, a tap or weight within its
// bound.
constexpr double kMaxLogRateError = 1;
constexpr double kMaxTapError = 2;
constexpr double kMaxWeightError = 1;
// Standard deviation of a curve's value about the line between its neighbours, as a share of the span of the angles.
constexpr double kTurn = 0.05;
constexpr std::size_t kFolds = 6;
constexpr std::size_t kMostFolds = 8;  // where whole recordings are left out
constexpr double kGuard_s = 1;

bool both_curves(const Structure& structure) {
  return structure.input_knots > 0 && structure.output_knots > 0;
}

// Quantiles of the values, pushed apart so that no two knots are closer than a quarter of what equal distances would be.
std::vector<double> quantile_knots(const std::vector<double>& sorted, int count) {
  const double range = sorted.back() - sorted.front();
  std::vector<double> knots(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) knots[static_cast<std::size_t>(i)] = quantile(sorted, i / (count - 1.0));
  const double least = range / (4 * (count - 1));
  for (std::size_t i = 1; i < knots.size(); ++i) knots[i] = std::max(knots[i], knots[i - 1] + least);
  knots.back() = std::max(knots.back(), sorted.back());
  for (std::size_t i = knots.size() - 1; i-- > 0;) knots[i] = std::min(knots[i], knots[i + 1] - least);
  return knots;
}

double root_mean_square(const VectorXd& r) {
  return std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
}

// The problem in terms of the free parameters; the others keep their value.
class Problem {
 public:
  Problem(const Predictor& predictor, const Data& data, const ChainOptions& options)
      : predictor_(predictor),
        rows_(used_rows(data)),
        angle_(data.angle_deg(rows_)),
        span_deg_(angle_.maxCoeff() - angle_.minCoeff()) {
    root_ = data.weight(rows_).cwiseSqrt();
    own_ = std::ranges::lower_bound(rows_, data.size()) - rows_.begin();
    set_bounds(data, options);
    turns_.resize(0, predictor.layout().size);
  }

  // From here on a curve's values are thought to lie beside the line between their neighbours by `weight` to one against an error.
  void expect_straight(double weight) {
    const auto add = [&](const std::vector<double>& x, int at) {
      for (std::size_t i = 1; i + 1 < x.size(); ++i) {
        const double share = (x[i] - x[i - 1]) / (x[i + 1] - x[i - 1]);
        turns_.conservativeResizeLike(MatrixXd::Zero(turns_.rows() + 1, turns_.cols()));
        turns_.bottomRows(1).middleCols(at + static_cast<int>(i) - 1, 3) =
            weight * Eigen::RowVector3d(1 - share, -1, share);
      }
    };
    add(predictor_.knots().input, predictor_.layout().input_curve);
    add(predictor_.knots().output, predictor_.layout().output_curve);
  }

  const Predictor& predictor() const { return predictor_; }
  const std::vector<Index>& rows() const { return rows_; }
  const VectorXd& lower() const { return lower_; }
  const VectorXd& upper() const { return upper_; }
  double span_deg() const { return span_deg_; }
  // What a curve may say.
  model::Saturation angles() const { return open_limits(angle_); }

  // Bent as by the loss of this width, and the prior's, with their Jacobian by the free parameters, unless that is null.
  VectorXd residual(const VectorXd& theta, const std::vector<int>& free, double delta,
                    Jacobian* jacobian) const {
    const VectorXd predicted = predictor_.predict(theta, jacobian ? &all_ : nullptr);
    const Index n = angle_.size();
    VectorXd out(n + turns_.rows());
    if (jacobian) jacobian->resize(out.size(), std::ssize(free));
    for (Index i = 0; i < n; ++i) {
      const Index k = rows_[static_cast<std::size_t>(i)];
      const Bent bent = bend(root_(i) * (predicted(k) - angle_(i)), delta);
      out(i) = bent.value;
      for (Index c = 0; jacobian && c < jacobian->cols(); ++c)
        (*jacobian)(i, c) = root_(i) * bent.slope * all_(k, free[static_cast<std::size_t>(c)]);
    }
    out.tail(turns_.rows()) = turns_ * theta;
    if (jacobian) jacobian->bottomRows(turns_.rows()) = turns_(Eigen::all, free);
    return out;
  }
  VectorXd own_residual(const VectorXd& theta) const {
    return (predictor_.predict(theta, nullptr)(rows_) - angle_).head(own_);
  }

 private:
  void set_bounds(const Data& data, const ChainOptions& options) {
    const Layout& layout = predictor_.layout();
    const Structure& structure = predictor_.structure();
    lower_ = VectorXd::Constant(layout.size, -kInfinity);
    upper_ = VectorXd::Constant(layout.size, kInfinity);
    const auto bound = [&](int at, int count, double low, double high) {
      lower_.segment(at, count).setConstant(low);
      upper_.segment(at, count).setConstant(high);
    };
    const VectorXd input = data.input(rows_);
    const double range = input.maxCoeff() - input.minCoeff();
    if (structure.dead_zone) {
      bound(layout.dead_zone, 1, input.minCoeff(), input.maxCoeff());
      bound(layout.dead_zone + 1, 1, 0, range);
    }
    if (structure.plays > 0) {
      bound(layout.radii, structure.plays, 0, range / 2);
      bound(layout.weights, structure.plays, -kMaxPlayWeight, kMaxPlayWeight);
    }
    const auto [lower_deg, upper_deg] = angles();
    for (const auto& [at, knots] : layout.curves) bound(at, knots, lower_deg, upper_deg);
    if (structure.order > 0) {
      // From a time constant that the recording shows ten times over to one that has settled within a sample.
      const double duration_s = static_cast<double>(data.size()) * data.period_s;
      const double limit_s = options.slowest_s > 0 ? options.slowest_s : duration_s / kSlowestPerRecording;
      bound(layout.log_rates, structure.order, std::log(1 / limit_s), std::log(6 / data.period_s));
    }
    if (structure.pair) bound(layout.log_rates + 1, 1, kLeastDamping, kMostDamping);
    if (structure.taps() > 0) bound(layout.taps, structure.taps(), -kMaxTap, kMaxTap);
    if (structure.saturation) {
      const double middle = (angle_.minCoeff() + angle_.maxCoeff()) / 2;
      bound(layout.saturation, 1, lower_deg, middle);
      bound(layout.saturation + 1, 1, middle, upper_deg);
    }
  }

  const Predictor& predictor_;
  std::vector<Index> rows_;
  Index own_ = 0;
  VectorXd root_;
  VectorXd angle_;
  double span_deg_;
  VectorXd lower_;
  VectorXd upper_;
  MatrixXd turns_;        // residuals of the prior, by the parameters
  mutable Jacobian all_;  // kept between calls: fresh pages for it cost more than the arithmetic
};

struct Solution {
  VectorXd theta;
  double cost = kInfinity;
  int iterations = 0;
};

Solution solve(const Problem& problem, VectorXd theta, const std::vector<int>& free, double delta,
               const LmOptions& options) {
  theta(free) = theta(free).cwiseMax(problem.lower()(free)).cwiseMin(problem.upper()(free)).eval();
  const auto residual = [&](const VectorXd& x, Jacobian* jacobian) {
    theta(free) = x;
    return problem.residual(theta, free, delta, jacobian);
  };
  VectorXd x = theta(free);
  const LmSummary summary =
      levenberg_marquardt<Jacobian>(residual, problem.lower()(free), problem.upper()(free), options, x);
  theta(free) = x;
  return {std::move(theta), summary.cost, summary.iterations};
}

// Starts for what is not linear in the parameters; the linear part follows by least squares.
class Starts {
 public:
  Starts(const Problem& problem, const Data& data)
      : problem_(problem),
        predictor_(problem.predictor()),
        layout_(predictor_.layout()),
        data_(data),
        input_(data.input(problem.rows())),
        angle_(data.angle_deg(problem.rows())) {}

  std::vector<VectorXd> make(bool only_first) const {
    static const std::vector<std::vector<std::vector<double>>> kRates = {
        {{}},
        {{15}, {3}, {40}, {0.8}},
        {{20, 1}, {15, 0.2}, {30, 6}, {4, 3}},
        {{30, 3, 0.3}, {20, 1, 0.08}, {40, 10, 1}, {8, 5, 2}}};
    static const std::vector<std::vector<double>> kPairs = {{8, 0.5}, {20, 0.5}, {3, 0.3}, {30, 0.8}};
    const Structure& structure = predictor_.structure();
    const double range = input_.maxCoeff() - input_.minCoeff();
    std::vector<VectorXd> starts;
    for (const auto& rates : structure.pair ? kPairs : kRates[static_cast<std::size_t>(structure.order)]) {
      const bool is_even = starts.size() % 2 == 0;
      VectorXd theta = VectorXd::Zero(layout_.size);
      for (int i = 0; i < structure.order; ++i)
        theta(layout_.log_rates + i) = std::log(rates[static_cast<std::size_t>(i)]);
      if (structure.pair) theta(layout_.log_rates + 1) = rates[1];
      for (int i = 0; i + 1 < structure.order && !structure.pair; ++i)
        theta(layout_.taps + i) = 1.0 / structure.order;
      if (both_curves(structure)) set_first_curve(theta);
      for (int j = 0; j < structure.plays; ++j) {
        theta(layout_.radii + j) = range * 0.02 * std::pow(3, j) * (is_even ? 1 : 2);
        theta(layout_.weights + j) = 0.3;
      }
      if (structure.saturation) {
        theta(layout_.saturation) = quantile(sorted(angle_), 0.005);
        theta(layout_.saturation + 1) = quantile(sorted(angle_), 0.995);
      }
      // Saturated samples bend the straight part: every other start leaves them out.
      const std::vector<Index> rows =
          is_even || !structure.saturation ? problem_.rows() : unsaturated_rows(theta);
      if (structure.dead_zone)
        search_dead_zone(theta, rows, range);
      else
        solve_linear_part(theta, rows);
      starts.push_back(theta);
      if (only_first) break;
    }
    return starts;
  }

 private:
  // The line through the samples; the curve behind it bends it.
  void set_first_curve(VectorXd& theta) const {
    const Eigen::ArrayXd off = input_.array() - input_.mean();
    const double slope = off.matrix().dot(angle_) / off.square().sum();
    for (int at = layout_.input_curve; const double x : predictor_.knots().input)
      theta(at++) = angle_.mean() + slope * (x - input_.mean());
  }

  std::vector<Index> unsaturated_rows(const VectorXd& theta) const {
    const int at = layout_.saturation;
    const double margin = kSaturatedMargin * (theta(at + 1) - theta(at));
    std::vector<Index> rows;
    for (const Index k : problem_.rows()) {
      const double y = data_.angle_deg(k);
      if (y > theta(at) + margin && y < theta(at + 1) - margin) rows.push_back(k);
    }
    return std::ssize(rows) >= kSamplesPerParameter * layout_.size ? rows : problem_.rows();
  }

  // The angle is linear in the curve's values (or gain and offset) until it saturates: least squares over the
  // samples, slightly damped so that knots without samples stay near their neighbours' mean.
  double solve_linear_part(VectorXd& theta, const std::vector<Index>& rows) const {
    Structure open = predictor_.structure();
    open.saturation = false;
    const int count =
        both_curves(open) ? open.output_knots : std::max({open.input_knots, open.output_knots, 2});
    const int at = std::max({layout_.input_curve, layout_.output_curve, layout_.affine});
    const VectorXd angle = data_.angle_deg(rows);
    // Linear in these parameters: the Jacobian at any value of them is the regression matrix. A gain of one
    // keeps the blocks before it visible.
    const Predictor linear(open, predictor_.knots(), predictor_.input(), predictor_.period_s());
    VectorXd probe = theta.head(linear.layout().size);
    probe.segment(at, count).setZero();
    MatrixXd a = MatrixXd::Ones(std::ssize(rows), count);
    VectorXd value;
    if (layout_.affine >= 0) {
      probe(at) = 1;
      a.col(0) = linear.predict(probe, nullptr)(rows);
      value = a.colPivHouseholderQr().solve(angle);
    } else {
      Jacobian all;
      (void)linear.predict(probe, &all);
      a = all.middleCols(at, count)(rows, Eigen::all);
      const double damping = 1e-3 * a.norm() / std::sqrt(static_cast<double>(count));
      MatrixXd damped(a.rows() + count, count);
      damped << a, damping * MatrixXd::Identity(count, count);
      VectorXd right = VectorXd::Zero(damped.rows());
      right.head(a.rows()) = angle.array() - angle.mean();
      value = damped.colPivHouseholderQr().solve(right).array() + angle.mean();  // the hats sum to one
    }
    theta.segment(at, count) = value;
    return root_mean_square(a * value - angle);
  }

  void search_dead_zone(VectorXd& theta, const std::vector<Index>& rows, double range) const {
    const int at = layout_.dead_zone;
    VectorXd best = theta;
    double least = kInfinity;
    constexpr int kGrid = 12;
    for (int low = 0; low < kGrid; ++low) {
      for (int high = low; high <= kGrid; ++high) {
        if (low == 0 && high == kGrid) continue;  // nothing would be left
        theta(at) = input_.minCoeff() + range * low / kGrid;
        theta(at + 1) = range * (high - low) / kGrid;
        const double rms = solve_linear_part(theta, rows);
        if (rms < least) {
          least = rms;
          best = theta;
        }
      }
    }
    theta = best;
  }

  const Problem& problem_;
  const Predictor& predictor_;
  const Layout& layout_;
  const Data& data_;
  VectorXd input_;  // of the used samples: the others may be held back
  VectorXd angle_;
};

void check_data(const Structure& structure, const Data& data, const std::vector<Index>& rows) {
  const int parameters = Layout(structure).size;
  if (std::ssize(rows) < kSamplesPerParameter * parameters) {
    throw io::JobError("{}: {} usable samples are too few for the {} parameters of {}; record longer",
                       data.channel, rows.size(), parameters, text_of(structure));
  }
  const auto require_change = [&](const VectorXd& signal, const char* what) {
    const VectorXd used = signal(rows);
    if (used.maxCoeff() > used.minCoeff()) return;
    throw io::JobError(
        "{}: the {} does not change in the fitted part (always {}); record a motion over the whole range",
        data.channel, what, used(0));
  };
  require_change(data.input, "sensor");
  require_change(data.angle_deg, "angle");
}

Knots place_knots(const Structure& structure, const Data& data, const std::vector<Index>& rows,
                  const ChainOptions& options) {
  if (options.knots) return *options.knots;
  const auto input = sorted(data.input(rows));
  Knots knots;
  if (structure.input_knots > 0) knots.input = quantile_knots(input, structure.input_knots);
  if (structure.output_knots > 0)
    knots.output =
        quantile_knots(both_curves(structure) ? sorted(data.angle_deg(rows)) : input, structure.output_knots);
  return knots;
}

// Without the copies of the recording.
Data own_part(Data data) {
  for (VectorXd* of : {&data.input, &data.angle_deg, &data.weight}) of->conservativeResize(data.size());
  data.own = 0;
  return data;
}

class Fitter {
 public:
  Fitter(const Structure& structure, const Data& data, const ChainOptions& options)
      : data_(data),
        own_(own_part(data)),
        options_(options),
        predictor_(structure, place_knots(structure, data, used_rows(own_), options), data.input,
                   data.period_s),
        own_predictor_(structure, predictor_.knots(), own_.input, data.period_s),
        problem_(predictor_, data, options),
        own_problem_(own_predictor_, own_, options),
        free_(static_cast<std::size_t>(predictor_.layout().size)) {
    std::iota(free_.begin(), free_.end(), 0);
    if (gain_alone()) {
      const Layout& layout = predictor_.layout();
      if (layout.dead_zone < 0 || layout.affine < 0)
        throw io::InputError("{}: has no dead zone to fit", data.channel);
      held_ = free_;
      free_ = {layout.dead_zone + 1, layout.affine};
      for (const int i : free_) std::erase(held_, i);
    }
    if (!both_curves(structure)) return;
    const int first = predictor_.layout().input_curve;
    held_ = {first, first + structure.input_knots - 1};
    for (const int end : held_) std::erase(free_, end);
  }

  Summary run() {
    search();
    settle();
    return summary();
  }

 private:
  bool gain_alone() const { return options_.initial && options_.initial->gain_alone; }

  [[noreturn]] void fail(const char* why) const {
    throw io::JobError("{}: {}: {}", data_.channel, text_of(predictor_.structure()), why);
  }

  // Every start by some steps of plain least squares to the recording alone; the best of two that go on sets the scale of the
  // robust loss.
  void search() {
    constexpr LmOptions kFirst{.max_iterations = 15, .cost_tolerance = 1e-4};
    constexpr LmOptions kRough{.max_iterations = 30, .cost_tolerance = 1e-4};
    constexpr std::size_t kGoOn = 2;
    deviation_deg_ = options_.deviation_deg;
    std::vector<VectorXd> starts;
    if (options_.from != From::initial)
      starts = Starts(own_problem_, own_).make(options_.from == From::first);
    if (options_.initial) starts.push_back(predictor_.theta(options_.initial->chain));
    if (gain_alone()) add_dead_zones(starts);
    std::vector<std::pair<Solution, std::size_t>> tried;
    for (std::size_t k = 0; k < starts.size(); ++k)
      tried.emplace_back(deviation_deg_ > 0 ? Solution{starts[k], 0, 0}
                                            : solve(own_problem_, starts[k], free_, kInfinity, kFirst),
                         k);
    std::ranges::stable_sort(tried, {}, [](const auto& one) { return one.first.cost; });
    for (std::size_t k = 0; k < std::min(kGoOn, tried.size()); ++k) {
      auto& [s, start] = tried[k];
      if (!(deviation_deg_ > 0) && s.iterations == kFirst.max_iterations) {
        const int before = s.iterations;
        s = solve(own_problem_, s.theta, free_, kInfinity, kRough);
        s.iterations += before;
      }
      if (!(s.cost < best_.cost)) continue;
      best_ = s;
      best_start_ = start;
      iterations_ = best_.iterations;
      initial_ = starts[start];
    }
    if (!std::isfinite(best_.cost)) fail("no start converged; is the motion rich enough?");
    if (!(deviation_deg_ > 0)) {
      const VectorXd r = own_problem_.own_residual(best_.theta);
      deviation_deg_ = std::max(robust_deviation(r), 1e-3 / kRobustScale * root_mean_square(r));
    }
    delta_ = kRobustScale * deviation_deg_;
    problem_.expect_straight(deviation_deg_ / (kTurn * problem_.span_deg()));
    if (!(delta_ > 0) || predictor_.structure() == Structure{})
      delta_ = kInfinity;  // a line: as anybody draws it
  }

  // A dead zone beyond all readings, or angles beyond the limits, tell nothing of where either should be: from dead zones that end
  // within the readings to the farthest angle at the last of these.
  void add_dead_zones(std::vector<VectorXd>& starts) const {
    const int zone = predictor_.layout().dead_zone;
    const int gain = predictor_.layout().affine;
    const VectorXd readings = own_.input(own_problem_.rows());
    const VectorXd angles = own_.angle_deg(own_problem_.rows());
    const double range = readings.maxCoeff() - readings.minCoeff();
    for (const double share : {0.0, 0.25, 0.5, 0.75}) {
      VectorXd& start = starts.emplace_back(starts.front());
      const double top_deg = start(gain) > 0 ? angles.maxCoeff() : angles.minCoeff();
      start(zone + 1) = readings.minCoeff() + share * range - start(zone);
      start(gain) = (top_deg - start(gain + 1)) / ((1 - share) * range);
    }
  }

  // Converges, then drops what the data cannot determine, one parameter at a time, until they determine all that is left.
  void settle() {
    hold_what_has_no_samples();
    while (true) {
      best_ = solve(problem_, best_.theta, free_, delta_, {.cost_tolerance = options_.cost_tolerance});
      iterations_ += best_.iterations;
      if (!std::isfinite(best_.cost)) fail("the fit did not converge");
      if (hold_at_bounds()) continue;
      Jacobian jacobian;
      const VectorXd residual = problem_.residual(best_.theta, free_, kInfinity, &jacobian);
      const Index n = std::ssize(problem_.rows());
      uncertainty_ = uncertainty(residual.head(n), jacobian.topRows(n), delta_,
                                 jacobian.bottomRows(residual.size() - n));
      const std::optional<int> worst = loosest();
      if (!worst) return;
      hold(*worst);
      if (free_.empty()) fail("the data determine no parameter");
    }
  }

  // A saturation that too few samples reach would be an outlier's value, not a limit.
  void hold_what_has_no_samples() {
    if (!predictor_.structure().saturation || gain_alone()) return;
    const int at = predictor_.layout().saturation;
    VectorXd open = best_.theta;
    open(at) = -kInfinity;
    open(at + 1) = kInfinity;
    const VectorXd unlimited = predictor_.predict(open, nullptr)(problem_.rows());
    const auto enough = static_cast<Index>(std::max(20.0, 0.01 * static_cast<double>(unlimited.size())));
    if ((unlimited.array() < best_.theta(at)).count() < enough) hold(at);
    if ((unlimited.array() > best_.theta(at + 1)).count() < enough) hold(at + 1);
  }

  // A parameter that leans on its bound is not an estimate.
  bool hold_at_bounds() {
    bool any = false;
    for (const int i : std::vector<int>(free_)) {
      const double value = best_.theta(i);
      const double slack = 1e-6 * std::max(1.0, std::abs(value));
      if (value - problem_.lower()(i) > slack && problem_.upper()(i) - value > slack) continue;
      hold(i);
      any = true;
    }
    return any;
  }

  // A free parameter that the data do not determine, else the one whose standard error exceeds its limit most, if any does.
  std::optional<int> loosest() const {
    if (!uncertainty_.undetermined.empty())
      return free_[static_cast<std::size_t>(uncertainty_.undetermined.front())];
    const Layout& l = predictor_.layout();
    const Structure& structure = predictor_.structure();
    std::optional<int> worst;
    double excess = 1;
    const auto look = [&](int at, int count, double limit) {
      for (int i = at; i < at + count; ++i) {
        const auto place = std::ranges::find(free_, i);
        if (place == free_.end()) continue;
        const auto column = place - free_.begin();
        const double ratio = std::sqrt(uncertainty_.covariance(column, column)) / limit;
        if (ratio <= excess) continue;
        excess = ratio;
        worst = i;
      }
    };
    if (structure.order > 0) look(l.log_rates, structure.order, kMaxLogRateError);
    look(l.taps, structure.taps(), kMaxTapError);
    if (structure.plays > 0) look(l.weights, structure.plays, kMaxWeightError);
    return worst;
  }

  void hold(int parameter) {
    std::erase(free_, parameter);
    held_.push_back(parameter);
    const int at = predictor_.layout().saturation;
    if (at < 0) return;
    const std::vector<Index> rows = used_rows(data_);
    const model::Saturation safe = limits_at_rest(data_.angle_deg(rows), data_.input(rows), 1);
    if (parameter == at) best_.theta(at) = safe.lower_deg;
    if (parameter == at + 1) best_.theta(at + 1) = safe.upper_deg;
  }

  Summary summary() const {
    Summary s;
    s.theta = best_.theta;
    s.knots = predictor_.knots();
    s.effective = static_cast<double>(free_.size());
    s.start = static_cast<int>(best_start_) + 1;
    s.iterations = iterations_;
    s.fitted_rmse_deg = root_mean_square(problem_.own_residual(best_.theta));
    s.deviation_deg = deviation_deg_;
    s.condition = uncertainty_.condition;
    const std::vector<NamedParameter> all = predictor_.named(best_.theta);
    const std::vector<NamedParameter> initial = predictor_.named(initial_);
    MatrixXd gradient = MatrixXd::Zero(std::ssize(free_), std::ssize(all));
    for (const NamedParameter& named : all) {
      const bool refused = std::ranges::any_of(held_, [&](int h) { return named.gradient(h) != 0; });
      if (!refused) gradient.col(std::ssize(s.parameters)) = named.gradient(free_);
      s.parameters.push_back({named.name, named.value, 0, refused, initial[s.parameters.size()].value});
    }
    s.covariance = gradient.transpose() * uncertainty_.covariance * gradient;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      s.parameters[k].standard_error = std::sqrt(std::max(s.covariance(i, i), 0.0));
    }
    Predictor shipped = predictor_;
    VectorXd theta = best_.theta;
    shipped.go_on(problem_.angles(), theta);
    s.predicted_deg = shipped.predict(theta, nullptr);
    s.channel = shipped.channel(theta);
    if (gain_alone()) {  // all else to the bit
      const double edge = s.channel.dead_zone->upper;
      const double gain = s.channel.lti.gain;
      s.channel = options_.initial->chain;
      s.channel.dead_zone->upper = edge;
      s.channel.lti.gain = gain;
    }
    s.channel.name = data_.channel;
    if (!predictor_.structure().saturation) s.channel.saturation = problem_.angles();
    s.channel.rest_deg = quantile(sorted(data_.angle_deg(problem_.rows())), 0.5);
    return s;
  }

  const Data& data_;
  Data own_;
  const ChainOptions& options_;
  Predictor predictor_;
  Predictor own_predictor_;
  Problem problem_;
  Problem own_problem_;
  std::vector<int> free_;
  std::vector<int> held_;
  Solution best_;
  Uncertainty uncertainty_;
  double deviation_deg_ = 0;
  double delta_ = kInfinity;
  VectorXd initial_;
  std::size_t best_start_ = 0;
  int iterations_ = 0;
};

// Lags until the residuals' autocorrelation first falls below 2 / sqrt(n).
int correlation_length(const VectorXd& residual) {
  const auto n = residual.size();
  const VectorXd r = residual.array() - residual.mean();
  const double variance = r.squaredNorm();
  if (!(variance > 0)) return 0;
  const double threshold = 2 / std::sqrt(static_cast<double>(n));
  const auto most = static_cast<int>(std::min<Index>(n / 20, kMaxLags));
  for (int lag = 1; lag <= most; ++lag)
    if (r.head(n - lag).dot(r.tail(n - lag)) / variance < threshold) return lag - 1;
  return most;
}

}  // namespace

std::vector<Index> used_rows(const Data& data, bool own) {
  std::vector<Index> rows;
  for (Index k = 0; k < (own ? data.size() : data.weight.size()); ++k)
    if (data.weight(k) > 0) rows.push_back(k);
  return rows;
}

Summary fit(const Structure& structure, const Data& data, const ChainOptions& options) {
  check_data(structure, data, used_rows(data));
  return Fitter(structure, data, options).run();
}

Uncertainty uncertainty(const VectorXd& residual, const MatrixXd& jacobian, double delta,
                        const MatrixXd& prior) {
  const auto n = jacobian.rows();
  const auto p = jacobian.cols();
  Uncertainty result;

  // rho' (score) and rho'' (weight) of the pseudo-Huber loss; 1 and r for an infinite delta.
  const Eigen::ArrayXd z = 1 + (residual.array() / delta).square();
  const Eigen::ArrayXd score = residual.array() / z.sqrt();
  const Eigen::ArrayXd root_weight = z.pow(-0.75);

  MatrixXd weighted(n + prior.rows(), p);
  weighted << (jacobian.array().colwise() * root_weight).matrix(), prior;
  const VectorXd norms = weighted.colwise().norm();
  for (Index i = 0; i < p; ++i)
    if (!(norms(i) > 0)) result.undetermined.push_back(static_cast<int>(i));
  if (!result.undetermined.empty()) return result;

  const VectorXd scale = norms.cwiseInverse();
  const Eigen::JacobiSVD<MatrixXd, Eigen::HouseholderQRPreconditioner> svd(weighted * scale.asDiagonal(),
                                                                           Eigen::ComputeThinV);
  const VectorXd& sigma = svd.singularValues();
  result.condition = sigma(0) / std::max(sigma(p - 1), 1e-300);
  if (sigma(p - 1) < kRankTolerance * sigma(0)) {
    Index worst = 0;
    svd.matrixV().col(p - 1).cwiseAbs().maxCoeff(&worst);
    result.undetermined.push_back(static_cast<int>(worst));
    return result;
  }
  const MatrixXd inverse = scale.asDiagonal() * svd.matrixV() *
                           sigma.array().square().inverse().matrix().asDiagonal() *
                           svd.matrixV().transpose() * scale.asDiagonal();

  // Bartlett's weights are what a window of all lags has in common with itself, so much later.
  const MatrixXd g = jacobian.array().colwise() * score;
  const int lags = correlation_length(residual);
  MatrixXd windows = MatrixXd::Zero(n + lags, p);
  for (Index i = 0; i < p; ++i) {
    double sum = 0;
    for (Index k = 0; k < n + lags; ++k) {
      if (k < n) sum += g(k, i);
      if (k > lags) sum -= g(k - lags - 1, i);
      windows(k, i) = sum;
    }
  }
  const MatrixXd s = windows.transpose() * windows / (lags + 1);
  const double small_sample = static_cast<double>(n) / static_cast<double>(n - p);
  result.covariance = small_sample * inverse * s * inverse;
  return result;
}

std::vector<Fold> folds_of(const std::vector<Index>& used, const std::vector<Index>& begin, double period_s) {
  const auto place = [&](Index sample) {
    return static_cast<std::size_t>(std::ranges::lower_bound(used, sample) - used.begin());
  };
  const std::size_t n = begin.size() - 1;
  std::vector<Fold> out(n > 2 ? std::min(n, kMostFolds) : kFolds);
  const auto add = [&](Fold& fold, std::size_t from, std::size_t to) {
    const auto guard = std::min(std::lround(kGuard_s / period_s), static_cast<long>(to - from) / 4);
    if (from < to) fold.push_back({used[from], used[to - 1], guard});
  };
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (n > 2) {
      add(out[f], place(begin[f * n / out.size()]), place(begin[(f + 1) * n / out.size()]));
      continue;
    }
    for (std::size_t s = 0; s < n; ++s) {
      const std::size_t from = place(begin[s]);
      const std::size_t size = place(begin[s + 1]) - from;
      add(out[f], from + size * f / out.size(), from + size * (f + 1) / out.size());
    }
  }
  std::erase_if(out,
                [](const Fold& fold) { return fold.empty(); });  // of a recording without a usable sample
  return out;
}

std::vector<Summary> fit_folds(const Structure& structure, const Data& data, const std::vector<Fold>& folds,
                               const ChainOptions& options) {
  std::vector<Summary> out;
  for (const Fold& fold : folds) {
    Data rest = data;
    for (const Block& block : fold) {
      const Index end = std::min(block.last + block.guard + 1, data.size());
      for (Index k = std::max<Index>(block.first - block.guard, 0); k < end; ++k)
        for (Index copy = k; copy < rest.weight.size(); copy += data.size()) rest.weight(copy) = 0;
    }
    out.push_back(fit(structure, rest, options));
  }
  return out;
}

}  // namespace flexor::identify
