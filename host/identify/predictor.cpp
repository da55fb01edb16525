#include "host/identify/predictor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "host/identify/structure_text.hpp"
#include "host/io/io.hpp"
#include "host/model/discrete.hpp"
#include "runtime/compensator/curve.hpp"
#include "runtime/compensator/dead_zone.hpp"
#include "runtime/compensator/lti.hpp"

namespace flexor::identify {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The columns of the Jacobian that carry something so far; null when no Jacobian is wanted.
class Columns {
 public:
  Columns(MatrixXd* jacobian, Index rows, Index columns) : jacobian_(jacobian) {
    if (jacobian_ != nullptr) jacobian_->setZero(rows, columns);
  }

  bool wanted() const { return jacobian_ != nullptr; }
  auto open(int i) {
    active_.push_back(i);
    return jacobian_->col(i);
  }
  const std::vector<int>& active() const { return active_; }
  auto col(int i) { return jacobian_->col(i); }
  void scale(Index row, double slope) {
    for (const int i : active_) (*jacobian_)(row, i) *= slope;
  }

 private:
  MatrixXd* jacobian_;
  std::vector<int> active_;
};

void dead_zone(const Layout& layout, const VectorXd& theta, VectorXd& signal, Columns& columns) {
  const double lower = theta(layout.dead_zone);
  const double upper = lower + theta(layout.dead_zone + 1);
  if (columns.wanted()) {
    columns.open(layout.dead_zone) =
        -((signal.array() < lower) || (signal.array() > upper)).cast<double>().matrix();
    columns.open(layout.dead_zone + 1) = -(signal.array() > upper).cast<double>().matrix();
  }
  const compensator::DeadZone<double> phi{lower, upper};
  for (double& u : signal) u = phi(u);
}

// One pass over the samples for each play; p and its derivatives move together.
void hysteresis(const Structure& structure, const Layout& layout, const VectorXd& theta, VectorXd& signal,
                Columns& columns) {
  const std::vector<int> upstream = columns.active();
  const VectorXd u = signal;
  std::vector<VectorXd> upstream_u;
  for (const int c : upstream) upstream_u.emplace_back(columns.col(c));
  for (int j = 0; j < structure.plays; ++j) {
    const double r = theta(layout.radii + j);
    const double w = theta(layout.weights + j);
    VectorXd difference(u.size());
    VectorXd p_over_r = VectorXd::Zero(u.size());
    std::vector<double> p_over_upstream(upstream.size());
    for (std::size_t c = 0; c < upstream.size(); ++c) p_over_upstream[c] = upstream_u[c](0);
    double p = u(0);
    double over_r = 0;
    for (Index k = 0; k < u.size(); ++k) {
      const bool up = p < u(k) - r;
      const bool down = p > u(k) + r;
      if (up || down) {
        p = u(k) + (up ? -r : r);
        over_r = up ? -1 : 1;
        for (std::size_t c = 0; c < upstream.size(); ++c) p_over_upstream[c] = upstream_u[c](k);
      }
      difference(k) = p - u(k);
      p_over_r(k) = over_r;
      for (std::size_t c = 0; c < upstream.size(); ++c) {
        columns.col(upstream[c])(k) += w * (p_over_upstream[c] - upstream_u[c](k));
      }
    }
    signal += w * difference;
    if (columns.wanted()) {
      columns.open(layout.radii + j) = w * p_over_r;
      columns.open(layout.weights + j) = difference;
    }
  }
}

void curve(const std::vector<double>& x, const VectorXd& y, int at, VectorXd& signal, Columns& columns) {
  const auto n = static_cast<int>(x.size());
  const std::vector<int> upstream = columns.active();
  if (columns.wanted()) {
    for (int i = 0; i < n; ++i) columns.open(at + i);
  }
  for (Index k = 0; k < signal.size(); ++k) {
    const double u = std::clamp(signal(k), x.front(), x.back());
    const auto i = static_cast<int>(compensator::find_segment(x.data(), static_cast<std::uint8_t>(n), u));
    const double width = x[static_cast<std::size_t>(i) + 1] - x[static_cast<std::size_t>(i)];
    const double share = (u - x[static_cast<std::size_t>(i)]) / width;
    const double slope = signal(k) == u ? (y(i + 1) - y(i)) / width : 0;
    signal(k) = y(i) + share * (y(i + 1) - y(i));
    if (!columns.wanted()) continue;
    for (const int c : upstream) columns.col(c)(k) *= slope;
    columns.col(at + i)(k) = 1 - share;
    columns.col(at + i + 1)(k) = share;
  }
}

// The chain of lags with `n` states, run over a column in place: y = sum of taps times states.
class Filter {
 public:
  Filter(const model::ZeroOrderHold& hold, const VectorXd& taps) : n_(static_cast<int>(hold.input.size())) {
    for (int i = 0; i < n_; ++i) {
      b_[i] = hold.input(i);
      tap_[i] = taps(i);
      for (int j = 0; j <= i; ++j) a_[i][j] = hold.transition(i, j);
    }
  }

  // Several columns at a time: one column alone waits for its own recursion at every sample.
  void run(const std::vector<double*>& columns, Index rows) const {
    for (std::size_t c = 0; c < columns.size(); c += kLanes) {
      // Lanes beyond the last column share a scratch column of zeros, which stay zeros.
      VectorXd scratch = VectorXd::Zero(c + kLanes > columns.size() ? rows : 0);
      std::array<double*, kLanes> lane;
      for (std::size_t l = 0; l < kLanes; ++l)
        lane[l] = c + l < columns.size() ? columns[c + l] : scratch.data();
      if (n_ == 1) run_lanes<1>(lane, rows);
      if (n_ == 2) run_lanes<2>(lane, rows);
      if (n_ == 3) run_lanes<3>(lane, rows);
    }
  }

  void advance(std::array<double, compensator::kMaxOrder>& x, double input) const {
    for (int i = n_ - 1; i >= 0; --i) {
      double next = b_[i] * input;
      for (int j = 0; j <= i; ++j) next += a_[i][j] * x[static_cast<std::size_t>(j)];
      x[static_cast<std::size_t>(i)] = next;
    }
  }

 private:
  static constexpr std::size_t kLanes = 4;
  using Lanes = Eigen::Array<double, kLanes, 1>;

  template <int kOrder>
  void run_lanes(const std::array<double*, kLanes>& lane, Index rows) const {
    const auto inputs = [&](Index k) { return Lanes(lane[0][k], lane[1][k], lane[2][k], lane[3][k]); };
    std::array<Lanes, kOrder> x;
    x.fill(inputs(0));
    for (Index k = 0; k < rows; ++k) {
      const Lanes w = inputs(k);
      Lanes y = Lanes::Zero();
      for (std::size_t i = kOrder; i-- > 0;) {
        Lanes next = b_[i] * w;
        for (std::size_t j = 0; j <= i; ++j) next += a_[i][j] * x[j];
        x[i] = next;
      }
      for (std::size_t i = 0; i < kOrder; ++i) y += tap_[i] * x[i];
      for (std::size_t l = 0; l < kLanes; ++l) lane[l][k] = y(static_cast<Index>(l));
    }
  }

  int n_;
  double a_[compensator::kMaxOrder][compensator::kMaxOrder] = {};
  double b_[compensator::kMaxOrder] = {};
  double tap_[compensator::kMaxOrder] = {};
};

void pole_pair(const Layout& layout, const VectorXd& theta, double period_s, VectorXd& signal,
               Columns& columns) {
  const double q = std::exp(theta(layout.log_rates)) * period_s;
  const double zeta = theta(layout.log_rates + 1);
  const auto block =
      model::PolePair{q / period_s, zeta, {theta(layout.taps), theta(layout.taps + 1)}}.floating<double>(
          period_s);
  const auto run = [&](auto column) {
    compensator::PolePair<double>::State state;
    block.start(state, column(0));
    for (double& v : column) v = block.step(state, v);
  };
  for (const int c : columns.active()) run(columns.col(c));
  const VectorXd u = signal;
  run(Eigen::Ref<VectorXd>(signal));
  if (!columns.wanted()) return;
  const Eigen::Matrix2d a{{0, q}, {-q, -2 * zeta * q}};
  const Eigen::Matrix2d transition{{block.transition[0], block.transition[1]},
                                   {block.transition[2], block.transition[3]}};
  const Eigen::Matrix2d change[] = {a * transition,
                                    model::exp_derivative(a, Eigen::Matrix2d{{0, 0}, {0, -2 * q}})};
  const Eigen::RowVector2d weight(1 - block.tap[0], block.tap[1]);
  Eigen::Vector2d e = Eigen::Vector2d::Zero();
  Eigen::Vector2d by[] = {e, e};  // log of the frequency, damping
  for (int i = 0; i < 2; ++i) {
    columns.open(layout.log_rates + i);
    columns.open(layout.taps + i);
  }
  for (Index k = 0; k < u.size(); ++k) {
    e(0) -= k > 0 ? u(k) - u(k - 1) : 0;
    for (int i = 0; i < 2; ++i) {
      by[i] = (transition * by[i] + change[i] * e).eval();
      columns.col(layout.log_rates + i)(k) = weight.dot(by[i]);
    }
    e = transition * e;
    columns.col(layout.taps)(k) = -e(0);
    columns.col(layout.taps + 1)(k) = e(1);
  }
}

void lti(const Structure& structure, const Layout& layout, const VectorXd& theta, double period_s,
         VectorXd& signal, Columns& columns) {
  const int n = structure.order;
  const VectorXd rates = theta.segment(layout.log_rates, n).array().exp();
  VectorXd taps(n);
  taps(n - 1) = 1;
  for (int i = 0; i + 1 < n; ++i) {
    taps(i) = theta(layout.taps + i);
    taps(n - 1) -= taps(i);
  }
  const model::ZeroOrderHold hold = model::zero_order_hold(rates, period_s);
  const Filter filter(hold, taps);
  if (!columns.wanted()) {
    filter.run({signal.data()}, signal.size());
    return;
  }
  std::vector<double*> upstream;
  for (const int c : columns.active()) upstream.push_back(columns.col(c).data());
  filter.run(upstream, signal.size());

  // The states, and for each rate the sensitivity s[k+1] = A s[k] + dA x[k] + db w[k].
  std::vector<model::ZeroOrderHold> derivative;
  std::vector<std::array<double, compensator::kMaxOrder>> s(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    derivative.push_back(model::zero_order_hold_derivative(rates, period_s, i));
    s[static_cast<std::size_t>(i)].fill(0);
    columns.open(layout.log_rates + i);
  }
  for (int i = 0; i + 1 < n; ++i) columns.open(layout.taps + i);
  std::array<double, compensator::kMaxOrder> x;
  x.fill(signal(0));
  for (Index k = 0; k < signal.size(); ++k) {
    const double w = signal(k);
    for (int r = 0; r < n; ++r) {
      auto& sensitivity = s[static_cast<std::size_t>(r)];
      const model::ZeroOrderHold& d = derivative[static_cast<std::size_t>(r)];
      filter.advance(sensitivity, 0);
      double y = 0;
      for (int i = 0; i < n; ++i) {
        auto& si = sensitivity[static_cast<std::size_t>(i)];
        si += d.input(i) * w;
        for (int j = 0; j <= i; ++j) si += d.transition(i, j) * x[static_cast<std::size_t>(j)];
        y += taps(i) * si;
      }
      columns.col(layout.log_rates + r)(k) = y;
    }
    filter.advance(x, w);
    double y = 0;
    for (int i = 0; i < n; ++i) y += taps(i) * x[static_cast<std::size_t>(i)];
    for (int i = 0; i + 1 < n; ++i) {
      columns.col(layout.taps + i)(k) = x[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(n - 1)];
    }
    signal(k) = y;
  }
}

void saturation(const Layout& layout, const VectorXd& theta, VectorXd& signal, Columns& columns) {
  const double lower = theta(layout.saturation);
  const double upper = theta(layout.saturation + 1);
  if (columns.wanted()) {
    for (Index k = 0; k < signal.size(); ++k) {
      if (signal(k) < lower || signal(k) > upper) columns.scale(k, 0);
    }
    columns.open(layout.saturation) = (signal.array() < lower).cast<double>().matrix();
    columns.open(layout.saturation + 1) = (signal.array() > upper).cast<double>().matrix();
  }
  signal = signal.cwiseMax(lower).cwiseMin(upper);
}

}  // namespace

Layout::Layout(const Structure& s) {
  const auto take = [this](int count) {
    const int at = size;
    size += count;
    return at;
  };
  if (s.dead_zone) dead_zone = take(2);
  if (s.plays > 0) radii = take(s.plays);
  if (s.plays > 0) weights = take(s.plays);
  if (s.input_knots > 0) input_curve = take(s.input_knots);
  if (s.input_knots == 0 && s.output_knots == 0) affine = take(2);
  if (s.order > 0) log_rates = take(s.order);
  if (s.taps() > 0) taps = take(s.taps());
  if (s.output_knots > 0) output_curve = take(s.output_knots);
  if (s.saturation) saturation = take(2);
  if (s.input_knots > 0) curves.emplace_back(input_curve, s.input_knots);
  if (s.output_knots > 0) curves.emplace_back(output_curve, s.output_knots);
}

Predictor::Predictor(const Structure& structure, Knots knots, VectorXd input, double period_s)
    : structure_(structure),
      layout_(structure),
      knots_(std::move(knots)),
      input_(std::move(input)),
      period_s_(period_s) {
  assert(std::ssize(knots_.input) == structure_.input_knots);
  assert(std::ssize(knots_.output) == structure_.output_knots);
}

VectorXd Predictor::predict(const VectorXd& theta, MatrixXd* jacobian) const {
  assert(theta.size() == layout_.size);
  VectorXd signal = input_;
  Columns columns(jacobian, signal.size(), layout_.size);
  if (structure_.dead_zone) dead_zone(layout_, theta, signal, columns);
  if (structure_.plays > 0) hysteresis(structure_, layout_, theta, signal, columns);
  if (structure_.input_knots > 0) {
    const VectorXd y = theta.segment(layout_.input_curve, structure_.input_knots);
    curve(knots_.input, y, layout_.input_curve, signal, columns);
  }
  if (layout_.affine >= 0) {
    const double gain = theta(layout_.affine);
    if (columns.wanted()) {
      for (const int c : columns.active()) columns.col(c) *= gain;
      columns.open(layout_.affine) = signal;
      columns.open(layout_.affine + 1).setOnes();
    }
    signal = (gain * signal.array() + theta(layout_.affine + 1)).matrix();
  }
  if (structure_.pair) {
    pole_pair(layout_, theta, period_s_, signal, columns);
  } else if (structure_.order > 0) {
    lti(structure_, layout_, theta, period_s_, signal, columns);
  }
  if (structure_.output_knots > 0) {
    const VectorXd y = theta.segment(layout_.output_curve, structure_.output_knots);
    curve(knots_.output, y, layout_.output_curve, signal, columns);
  }
  if (structure_.saturation) saturation(layout_, theta, signal, columns);
  return signal;
}

std::vector<NamedParameter> Predictor::named(const VectorXd& theta) const {
  std::vector<NamedParameter> all;
  const auto add = [&](std::string name, double value) -> VectorXd& {
    all.push_back({std::move(name), value, VectorXd::Zero(layout_.size)});
    return all.back().gradient;
  };
  const auto add_plain = [&](std::string name, int at) { add(std::move(name), theta(at))(at) = 1; };
  const auto add_curve = [&](const char* what, const std::vector<double>& x, int at) {
    for (std::size_t i = 0; i < x.size(); ++i)
      add_plain(fmt::format("{} at {:.5g}", what, x[i]), at + static_cast<int>(i));
  };
  if (structure_.dead_zone) {
    add_plain("dead zone lower edge", layout_.dead_zone);
    VectorXd& upper = add("dead zone upper edge", theta(layout_.dead_zone) + theta(layout_.dead_zone + 1));
    upper(layout_.dead_zone) = 1;
    upper(layout_.dead_zone + 1) = 1;
  }
  for (int j = 0; j < structure_.plays; ++j) {
    add_plain(fmt::format("radius of play {}", j + 1), layout_.radii + j);
    add_plain(fmt::format("weight of play {}", j + 1), layout_.weights + j);
  }
  if (structure_.input_knots > 0) add_curve("curve", knots_.input, layout_.input_curve);
  if (layout_.affine >= 0) {
    add_plain("gain", layout_.affine);
    add_plain("offset", layout_.affine + 1);
  }
  for (int i = 0; i < (structure_.pair ? 0 : structure_.order); ++i) {
    const double rate = std::exp(theta(layout_.log_rates + i));
    add(fmt::format("pole {} (rad/s)", i + 1), -rate)(layout_.log_rates + i) = -rate;
  }
  if (structure_.pair) {
    const double frequency = std::exp(theta(layout_.log_rates));
    add("frequency (rad/s)", frequency)(layout_.log_rates) = frequency;
    add_plain("damping", layout_.log_rates + 1);
  }
  for (int i = 0; i < structure_.taps(); ++i) add_plain(fmt::format("tap {}", i + 1), layout_.taps + i);
  if (structure_.output_knots > 0) add_curve("output curve", knots_.output, layout_.output_curve);
  if (structure_.saturation) {
    add_plain("saturation lower limit", layout_.saturation);
    add_plain("saturation upper limit", layout_.saturation + 1);
  }
  return all;
}

model::Channel Predictor::channel(const VectorXd& theta) const {
  const auto list = [](const VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  model::Channel c;
  if (structure_.dead_zone) {
    const double lower = theta(layout_.dead_zone);
    c.dead_zone = model::DeadZone{lower, lower + theta(layout_.dead_zone + 1)};
  }
  if (structure_.plays > 0) {
    c.hysteresis = model::Hysteresis{list(theta.segment(layout_.radii, structure_.plays)),
                                     list(theta.segment(layout_.weights, structure_.plays))};
  }
  if (structure_.input_knots > 0) {
    c.input_curve =
        model::Curve{knots_.input, list(theta.segment(layout_.input_curve, structure_.input_knots))};
  }
  if (layout_.affine >= 0) {
    c.lti.gain = theta(layout_.affine);
    c.lti.offset = theta(layout_.affine + 1);
  }
  if (structure_.pair) {
    c.pair = model::PolePair{std::exp(theta(layout_.log_rates)), theta(layout_.log_rates + 1),
                             list(theta.segment(layout_.taps, 2))};
  }
  for (int i = 0; i < (structure_.pair ? 0 : structure_.order); ++i) {
    c.lti.poles_rad_s.push_back(-std::exp(theta(layout_.log_rates + i)));
    c.lti.taps.push_back(i == 0 ? 0 : theta(layout_.taps + i - 1));
  }
  if (structure_.output_knots > 0) {
    c.output_curve =
        model::Curve{knots_.output, list(theta.segment(layout_.output_curve, structure_.output_knots))};
  }
  if (structure_.saturation) {
    c.saturation = {theta(layout_.saturation), theta(layout_.saturation + 1)};
  }
  return c;
}

Structure structure_of(const model::Channel& c) {
  Structure out;
  out.dead_zone = c.dead_zone.has_value();
  if (c.hysteresis) out.plays = static_cast<int>(c.hysteresis->radii.size());
  if (c.input_curve) out.input_knots = static_cast<int>(c.input_curve->x.size());
  out.pair = c.pair.has_value();
  out.order = out.pair ? 2 : static_cast<int>(c.lti.poles_rad_s.size());
  if (c.output_curve) out.output_knots = static_cast<int>(c.output_curve->x.size());
  out.saturation = true;
  return out;
}

VectorXd Predictor::theta(const model::Channel& c) const {
  Structure like = structure_of(c);
  like.saturation = structure_.saturation;
  if (like.input_knots > 0 && structure_.input_knots > 0) like.input_knots = structure_.input_knots;
  if (like.output_knots > 0 && structure_.output_knots > 0) like.output_knots = structure_.output_knots;
  if (like != structure_) {
    throw io::InputError(fmt::format("the initial model's {} is {}, not {}", c.name, text_of(structure_of(c)),
                                     text_of(structure_)));
  }
  VectorXd out = VectorXd::Zero(layout_.size);
  const auto set = [&](int at, const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) out(at + static_cast<int>(i)) = values[i];
  };
  if (c.dead_zone) set(layout_.dead_zone, {c.dead_zone->lower, c.dead_zone->upper - c.dead_zone->lower});
  if (c.hysteresis) set(layout_.radii, c.hysteresis->radii);
  if (c.hysteresis) set(layout_.weights, c.hysteresis->weights);
  // A gain beside a curve becomes part of it.
  const auto read = [&](const model::Curve& curve, const std::vector<double>& x, int at, bool behind) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double value = curve(behind ? c.lti.gain * x[i] + c.lti.offset : x[i]);
      out(at + static_cast<int>(i)) = behind ? value : c.lti.gain * value + c.lti.offset;
    }
  };
  if (c.input_curve) read(*c.input_curve, knots_.input, layout_.input_curve, false);
  if (c.output_curve) read(*c.output_curve, knots_.output, layout_.output_curve, !c.input_curve);
  if (layout_.affine >= 0) set(layout_.affine, {c.lti.gain, c.lti.offset});
  for (int i = 0; i < (c.pair ? 0 : structure_.order); ++i) {
    out(layout_.log_rates + i) = std::log(-c.lti.poles_rad_s[static_cast<std::size_t>(i)]);
    if (i > 0 && !c.lti.taps.empty()) out(layout_.taps + i - 1) = c.lti.taps[static_cast<std::size_t>(i)];
  }
  if (c.pair) set(layout_.log_rates, {std::log(c.pair->frequency_rad_s), c.pair->damping});
  if (c.pair) set(layout_.taps, c.pair->taps);
  if (structure_.saturation) set(layout_.saturation, {c.saturation.lower_deg, c.saturation.upper_deg});
  return out;
}

}  // namespace flexor::identify
