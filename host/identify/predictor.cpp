#include "host/identify/predictor.hpp"

#include <fmt/format.h>

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
using Eigen::RowVectorXd;
using Eigen::VectorXd;

// In each function below `j` holds the derivatives by the parameters of the blocks before; it has no columns where none are wanted. Both
// it and the signal are changed in place.
void dead_zone(const Layout& layout, const VectorXd& theta, VectorXd& signal, Jacobian& j) {
  const double lower = theta(layout.dead_zone);
  const double upper = lower + theta(layout.dead_zone + 1);
  const compensator::DeadZone<double> phi{lower, upper};
  for (Index k = 0; k < signal.size(); ++k) {
    double& u = signal(k);
    if (j.size() > 0) {
      j(k, layout.dead_zone) = -static_cast<double>(u < lower || u > upper);
      j(k, layout.dead_zone + 1) = -static_cast<double>(u > upper);
    }
    u = phi(u);
  }
}

// The plays and their derivatives move together.
void hysteresis(const Structure& structure, const Layout& layout, const VectorXd& theta, VectorXd& signal,
                Jacobian& j) {
  const Index before = j.size() > 0 ? layout.radii : 0;
  VectorXd p = VectorXd::Constant(structure.plays, signal(0));
  VectorXd by_radius = VectorXd::Zero(structure.plays);
  Jacobian by_before = j.topLeftCorner(1, before).replicate(structure.plays, 1);
  RowVectorXd by_u(before);
  for (Index k = 0; k < signal.size(); ++k) {
    const double u = signal(k);
    by_u = j.row(k).head(before);
    for (int i = 0; i < structure.plays; ++i) {
      const double r = theta(layout.radii + i);
      const double w = theta(layout.weights + i);
      const bool up = p(i) < u - r;
      if (up || p(i) > u + r) {
        p(i) = u + (up ? -r : r);
        by_radius(i) = up ? -1 : 1;
        by_before.row(i) = by_u;
      }
      signal(k) += w * (p(i) - u);
      if (j.size() == 0) continue;
      j.row(k).head(before) += w * (by_before.row(i) - by_u);
      j(k, layout.radii + i) = w * by_radius(i);
      j(k, layout.weights + i) = p(i) - u;
    }
  }
}

void curve(const std::vector<double>& x, const double* y, int at, VectorXd& signal, Jacobian& j) {
  for (Index k = 0; k < signal.size(); ++k) {
    const double u = std::clamp(signal(k), x.front(), x.back());
    const std::size_t i = compensator::find_segment(x.data(), static_cast<std::uint8_t>(x.size()), u);
    const double width = x[i + 1] - x[i];
    const double share = (u - x[i]) / width;
    const double slope = signal(k) == u ? (y[i + 1] - y[i]) / width : 0;
    signal(k) = y[i] + share * (y[i + 1] - y[i]);
    if (j.size() == 0) continue;
    j.row(k).head(at) *= slope;
    j.row(k).segment(at, std::ssize(x)).setZero();
    j(k, at + static_cast<Index>(i)) = 1 - share;
    j(k, at + static_cast<Index>(i) + 1) = share;
  }
}

void affine(const Layout& layout, const VectorXd& theta, VectorXd& signal, Jacobian& j) {
  const double gain = theta(layout.affine);
  if (j.size() > 0) {
    j.leftCols(layout.affine) *= gain;
    j.col(layout.affine) = signal;
    j.col(layout.affine + 1).setOnes();
  }
  signal = (gain * signal.array() + theta(layout.affine + 1)).matrix();
}

void pole_pair(const Layout& layout, const VectorXd& theta, double period_s, VectorXd& signal, Jacobian& j) {
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
  for (Index c = 0; c < layout.log_rates && j.size() > 0; ++c) run(j.col(c));
  const VectorXd u = signal;
  run(Eigen::Ref<VectorXd>(signal));
  if (j.size() == 0) return;
  const Eigen::Matrix2d a{{0, q}, {-q, -2 * zeta * q}};
  const Eigen::Matrix2d transition{{block.transition[0], block.transition[1]},
                                   {block.transition[2], block.transition[3]}};
  const Eigen::Matrix2d change[] = {a * transition,
                                    model::exp_derivative(a, Eigen::Matrix2d{{0, 0}, {0, -2 * q}})};
  const Eigen::RowVector2d weight(1 - block.tap[0], block.tap[1]);
  Eigen::Vector2d e = Eigen::Vector2d::Zero();
  Eigen::Vector2d by[] = {e, e};  // log of the frequency, damping
  for (Index k = 0; k < u.size(); ++k) {
    e(0) -= k > 0 ? u(k) - u(k - 1) : 0;
    for (int i = 0; i < 2; ++i) {
      by[i] = (transition * by[i] + change[i] * e).eval();
      j(k, layout.log_rates + i) = weight.dot(by[i]);
    }
    e = transition * e;
    j(k, layout.taps) = -e(0);
    j(k, layout.taps + 1) = e(1);
  }
}

// x[k+1] = A x[k] + b w[k], y = sum of taps times states, and s of each parameter: s[k+1] = A s[k] + dA x[k] + db w[k] + b dw[k].
template <int N>
void lti(const Layout& layout, const VectorXd& theta, double period_s, VectorXd& signal, Jacobian& j) {
  const VectorXd rates = theta.segment(layout.log_rates, N).array().exp();
  Eigen::Vector<double, N> taps;
  taps.head(N - 1) = theta.segment(std::max(layout.taps, 0), N - 1);
  taps(N - 1) = 1 - taps.head(N - 1).sum();
  const model::ZeroOrderHold hold = model::zero_order_hold(rates, period_s);
  const Eigen::Matrix<double, N, N> a = hold.transition;
  const Eigen::Vector<double, N> b = hold.input;
  const Index columns = j.size() > 0 ? layout.log_rates + N : 0;
  std::array<std::pair<Eigen::Matrix<double, N, N>, Eigen::Vector<double, N>>, N> by_rate;
  by_rate.fill({a, b});
  for (int i = 0; i < N && columns > 0; ++i) {
    const model::ZeroOrderHold by = model::zero_order_hold_derivative(rates, period_s, i);
    by_rate[static_cast<std::size_t>(i)] = {by.transition, by.input};
  }
  if (columns > 0) j.middleCols(layout.log_rates, N).setZero();
  Eigen::Matrix<double, N, Eigen::Dynamic> s = j.topLeftCorner(1, columns).replicate(N, 1);
  Eigen::Vector<double, N> x = Eigen::Vector<double, N>::Constant(signal(0));
  for (Index k = 0; k < signal.size(); ++k) {
    const double w = signal(k);
    double* by_signal = j.data() + k * j.cols();
    for (Index c = 0; c < columns; ++c) s.col(c) = (a * s.col(c) + b * by_signal[c]).eval();
    Index rate = layout.log_rates;
    for (const auto& [by_transition, by_input] : by_rate)
      if (columns > 0) s.col(rate++) += by_transition * x + by_input * w;
    x = (a * x + b * w).eval();
    signal(k) = taps.dot(x);
    for (Index c = 0; c < columns; ++c) by_signal[c] = taps.dot(s.col(c));
    for (int i = 0; i + 1 < N && columns > 0; ++i) by_signal[layout.taps + i] = x(i) - x(N - 1);
  }
}

void saturation(const Layout& layout, const VectorXd& theta, VectorXd& signal, Jacobian& j) {
  const double lower = theta(layout.saturation);
  const double upper = theta(layout.saturation + 1);
  for (Index k = 0; k < signal.size() && j.size() > 0; ++k) {
    j(k, layout.saturation) = static_cast<double>(signal(k) < lower);
    j(k, layout.saturation + 1) = static_cast<double>(signal(k) > upper);
    if (signal(k) < lower || signal(k) > upper) j.row(k).head(layout.saturation).setZero();
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

VectorXd Predictor::predict(const VectorXd& theta, Jacobian* jacobian) const {
  static constexpr std::array kLti = {lti<1>, lti<2>, lti<3>};
  static_assert(kLti.size() == compensator::kMaxOrder);
  assert(theta.size() == layout_.size);
  VectorXd signal = input_;
  Jacobian none(signal.size(), 0);
  Jacobian& j = jacobian != nullptr ? *jacobian : none;
  if (jacobian != nullptr) j.resize(signal.size(), layout_.size);
  if (structure_.dead_zone) dead_zone(layout_, theta, signal, j);
  if (structure_.plays > 0) hysteresis(structure_, layout_, theta, signal, j);
  if (structure_.input_knots > 0)
    curve(knots_.input, &theta(layout_.input_curve), layout_.input_curve, signal, j);
  if (layout_.affine >= 0) affine(layout_, theta, signal, j);
  if (structure_.pair)
    pole_pair(layout_, theta, period_s_, signal, j);
  else if (structure_.order > 0)
    kLti[static_cast<std::size_t>(structure_.order - 1)](layout_, theta, period_s_, signal, j);
  if (structure_.output_knots > 0)
    curve(knots_.output, &theta(layout_.output_curve), layout_.output_curve, signal, j);
  if (structure_.saturation) saturation(layout_, theta, signal, j);
  return signal;
}

std::vector<NamedParameter> Predictor::named(const VectorXd& theta) const {
  std::vector<NamedParameter> all;
  // One of theta, or what its exponential is times `scale`.
  const auto add = [&](std::string name, int at, double scale = 0) -> NamedParameter& {
    const double value = scale == 0 ? theta(at) : scale * std::exp(theta(at));
    NamedParameter& one =
        all.emplace_back(NamedParameter{std::move(name), value, VectorXd::Zero(layout_.size)});
    one.gradient(at) = scale == 0 ? 1 : value;
    return one;
  };
  const auto add_curve = [&](const char* what, const std::vector<double>& x, int at) {
    for (const double knot : x) add(fmt::format("{} at {:.5g}", what, knot), at++);
  };
  if (structure_.dead_zone) {
    add("dead zone lower edge", layout_.dead_zone);
    NamedParameter& upper = add("dead zone upper edge", layout_.dead_zone + 1);
    upper.value += theta(layout_.dead_zone);
    upper.gradient(layout_.dead_zone) = 1;
  }
  for (int j = 0; j < structure_.plays; ++j) {
    add(fmt::format("radius of play {}", j + 1), layout_.radii + j);
    add(fmt::format("weight of play {}", j + 1), layout_.weights + j);
  }
  add_curve("curve", knots_.input, layout_.input_curve);
  if (layout_.affine >= 0) {
    add("gain", layout_.affine);
    add("offset", layout_.affine + 1);
  }
  if (structure_.pair) {
    add("frequency (rad/s)", layout_.log_rates, 1);
    add("damping", layout_.log_rates + 1);
  }
  for (int i = 0; i < structure_.order && !structure_.pair; ++i)
    add(fmt::format("pole {} (rad/s)", i + 1), layout_.log_rates + i, -1);
  for (int i = 0; i < structure_.taps(); ++i) add(fmt::format("tap {}", i + 1), layout_.taps + i);
  add_curve("output curve", knots_.output, layout_.output_curve);
  if (structure_.saturation) {
    add("saturation lower limit", layout_.saturation);
    add("saturation upper limit", layout_.saturation + 1);
  }
  return all;
}

void Predictor::go_on(const model::Saturation& limits, VectorXd& theta) {
  constexpr double kShare = 0.5;
  const auto extend = [&](std::vector<double>& x, int at) {
    if (x.empty()) return;
    const VectorXd y = theta.segment(at, std::ssize(x));
    const auto last = static_cast<Index>(x.size()) - 1;
    const double run = kShare * (x.back() - x.front());
    const auto move = [&](double& end, double inner, Index i, Index next) {
      const double slope = (y(i) - y(next)) / (end - inner);
      if (slope * (y(last) - y(0)) <= 0) return;
      const double room = y(i) > y(next) ? limits.upper_deg - y(i) : y(i) - limits.lower_deg;
      const double by = std::copysign(std::clamp(room / std::abs(slope), 0.0, run), end - inner);
      end += by;
      theta(at + i) += by * slope;
    };
    move(x.front(), x[1], 0, 1);
    move(x.back(), x[x.size() - 2], last, last - 1);
  };
  extend(knots_.input, layout_.input_curve);
  extend(knots_.output, layout_.output_curve);
}

model::Channel Predictor::channel(const VectorXd& theta) const {
  const auto part = [&](int at, int count) {
    return std::vector<double>(theta.begin() + at, theta.begin() + at + count);
  };
  model::Channel c;
  if (structure_.dead_zone) {
    const double lower = theta(layout_.dead_zone);
    c.dead_zone = model::DeadZone{lower, lower + theta(layout_.dead_zone + 1)};
  }
  if (structure_.plays > 0)
    c.hysteresis =
        model::Hysteresis{part(layout_.radii, structure_.plays), part(layout_.weights, structure_.plays)};
  if (structure_.input_knots > 0)
    c.input_curve = model::Curve{knots_.input, part(layout_.input_curve, structure_.input_knots)};
  if (layout_.affine >= 0) {
    c.lti.gain = theta(layout_.affine);
    c.lti.offset = theta(layout_.affine + 1);
  }
  if (structure_.pair)
    c.pair = model::PolePair{std::exp(theta(layout_.log_rates)), theta(layout_.log_rates + 1),
                             part(layout_.taps, 2)};
  for (int i = 0; i < (structure_.pair ? 0 : structure_.order); ++i) {
    c.lti.poles_rad_s.push_back(-std::exp(theta(layout_.log_rates + i)));
    c.lti.taps.push_back(i == 0 ? 0 : theta(layout_.taps + i - 1));
  }
  if (structure_.output_knots > 0)
    c.output_curve = model::Curve{knots_.output, part(layout_.output_curve, structure_.output_knots)};
  if (structure_.saturation) c.saturation = {theta(layout_.saturation), theta(layout_.saturation + 1)};
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
    throw io::InputError("the initial model's {} is {}, not {}", c.name, text_of(structure_of(c)),
                         text_of(structure_));
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
