#include "host/model/coefficients.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model::detail {

Eigen::Index order_at(const Lti& lti, double period_s) {
  const auto n = static_cast<Eigen::Index>(lti.poles_rad_s.size());
  constexpr double kForgotten = 1e-9;
  return n > 1 && std::exp(lti.poles_rad_s.back() * period_s) < kForgotten ? n - 1 : n;
}

PaddedLti pad(const Lti& lti, double period_s, int order) {
  PaddedLti out{Eigen::VectorXd::Zero(order), Eigen::MatrixXd::Zero(order, order),
                Eigen::VectorXd::Zero(order)};
  const Eigen::Index n = order_at(lti, period_s);
  if (n == 0) {
    out.tap(0) = 1;  // y = w
    return out;
  }
  Eigen::VectorXd rates(n);
  for (Eigen::Index i = 0; i < n; ++i) rates(i) = -lti.poles_rad_s[static_cast<std::size_t>(i)];
  const ZeroOrderHold hold = zero_order_hold(rates, period_s);
  const Eigen::Index first = order - n;
  out.input_weight.tail(n) = hold.input;
  out.chain_weight.bottomRightCorner(n, n).triangularView<Eigen::StrictlyLower>() = hold.transition;
  if (!lti.taps.empty()) {
    out.tap(0) = lti.taps[0];
    for (Eigen::Index i = 1; i < n; ++i) out.tap(first + i) = lti.taps[static_cast<std::size_t>(i)];
  }
  return out;
}

void check_capacity(const Channel& channel, double period_s, int plays, int input_knots, int order,
                    int output_knots, bool taps) {
  const auto need = [&](std::size_t size, int capacity, const char* what) {
    if (size > static_cast<std::size_t>(capacity)) {
      throw io::InputError(
          fmt::format("channel {}: needs {} {}, the shape has {}", channel.name, size, what, capacity));
    }
  };
  need(channel.hysteresis ? channel.hysteresis->radii.size() : 0, plays, "plays");
  need(channel.input_curve ? channel.input_curve->x.size() : 0, input_knots, "knots");
  need(static_cast<std::size_t>(order_at(channel.lti, period_s)), order, "poles");
  const auto zero = [](double tap) { return tap == 0; };
  const bool plain =
      order >= 1 && !channel.lti.poles_rad_s.empty() && std::ranges::all_of(channel.lti.taps, zero);
  if (!taps && !plain)
    throw io::InputError(fmt::format("channel {}: needs taps, the shape has none", channel.name));
  need(channel.output_curve ? channel.output_curve->x.size() : 0, output_knots, "knots after the lti");
}

Interval after_dead_zone(const Channel& channel) {
  if (!channel.dead_zone) return {channel.valid_min, channel.valid_max};
  const compensator::DeadZone<double> zone{channel.dead_zone->lower, channel.dead_zone->upper};
  return {zone(channel.valid_min), zone(channel.valid_max)};
}

Interval after_hysteresis(const Channel& channel) {
  Interval range = after_dead_zone(channel);
  if (!channel.hysteresis) return range;
  double reach = 0;
  for (std::size_t j = 0; j < channel.hysteresis->radii.size(); ++j) {
    reach += std::abs(channel.hysteresis->weights[j]) * channel.hysteresis->radii[j];
  }
  return {range.min - reach, range.max + reach};
}

Interval after_input_curve(const Channel& channel) {
  if (!channel.input_curve) return after_hysteresis(channel);
  const auto [low, high] = std::ranges::minmax(channel.input_curve->y);
  return {low, high};
}

Interval after_gain(const Channel& channel) {
  const Interval in = after_input_curve(channel);
  const double a = channel.lti.gain * in.min + channel.lti.offset;
  const double b = channel.lti.gain * in.max + channel.lti.offset;
  return {std::min(a, b), std::max(a, b)};
}

double lti_bound(const Channel& channel) {
  const Interval w = after_gain(channel);
  double sum = 0;
  for (const double tap : channel.lti.taps) sum += std::abs(tap);
  return w.magnitude() + sum * (w.max - w.min);
}

void does_not_fit(const Channel& channel, const std::string& what) {
  throw io::InputError(fmt::format("channel {}: {} does not fit the fixed-point format", channel.name, what));
}

std::int16_t quantise(const Channel& channel, const char* what, double value, int fraction) {
  const double scaled = std::round(std::ldexp(value, fraction));
  if (!(std::abs(scaled) <= 32767)) does_not_fit(channel, fmt::format("{} ({:.6g})", what, value));
  return static_cast<std::int16_t>(scaled);
}

int best_fraction(const Channel& channel, const char* what, double magnitude, int low, int high) {
  for (int fraction = high; fraction >= low; --fraction) {
    if (std::round(std::ldexp(std::abs(magnitude), fraction)) <= 32767) return fraction;
  }
  does_not_fit(channel, fmt::format("{} ({:.6g})", what, magnitude));
}

namespace {

// What is left of anything after so many samples cannot be told: direct forms forget within a few.
constexpr Eigen::Index kMemory = 64;

bool is_plain_chain(const Channel& channel) {
  const Lti& lti = channel.lti;
  return !channel.hysteresis && !channel.input_curve && !channel.output_curve && lti.offset == 0 &&
         !lti.poles_rad_s.empty() && std::ranges::all_of(lti.taps, [](double tap) { return tap == 0; });
}

// First values of the response of the hold to a single sample of 1.
Eigen::VectorXd impulse_response(const ZeroOrderHold& hold, double gain, Eigen::Index count) {
  const Eigen::Index n = hold.input.size();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd response(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    x = hold.transition * x;
    if (k == 0) x += gain * hold.input;
    response(k) = x(n - 1);
  }
  return response;
}

// y[k] = b[k] + a_1 y[k-1] - a_2 y[k-2] + a_3 y[k-3]: to b as input.
Eigen::VectorXd recursion(const Eigen::VectorXd& b, const Eigen::VectorXd& a, Eigen::Index count) {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    if (k < b.size()) y(k) = b(k);
    for (Eigen::Index i = 0; i < std::min(a.size(), k); ++i)
      y(k) += (i % 2 == 0 ? a(i) : -a(i)) * y(k - 1 - i);
  }
  return y;
}

// The most that sum d_k v_k can be with 0 <= v_k <= top and sum h_k v_k <= upper; h is not negative. Inputs
// are spent where they bring most.
double largest_sum(const Eigen::VectorXd& d, const Eigen::VectorXd& h, double top, double upper) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index k = 0; k < d.size(); ++k) {
    if (d(k) > 0) order.push_back(k);
  }
  std::ranges::sort(order, [&](Eigen::Index i, Eigen::Index j) { return d(i) * h(j) > d(j) * h(i); });
  double sum = 0;
  for (const Eigen::Index k : order) {
    const double share = h(k) * top <= upper ? 1 : upper / (h(k) * top);
    sum += share * d(k) * top;
    upper -= share * h(k) * top;
    if (share < 1) break;
  }
  return sum;
}

// A direct form in double, and its neighbours in integers.
class DirectSearch {
 public:
  DirectSearch(const Channel& channel, const Eigen::VectorXd& rates, double period_s)
      : gain_(channel.lti.gain),
        top_(after_dead_zone(channel).max),
        upper_(std::max(channel.saturation.upper_deg, 0.0) + kOutputStep),
        edge_deg_(channel.dead_zone ? gain_ * std::max(off_step(channel.dead_zone->lower),
                                                       off_step(channel.dead_zone->upper))
                                    : 0),
        start_deg_(top_ * off_gain(channel)),
        order_(rates.size()),
        hold_(zero_order_hold(rates, period_s)),
        response_(impulse_response(hold_, gain_, kMemory)) {
    Eigen::VectorXd denominator = Eigen::VectorXd::Unit(order_ + 1, 0);
    for (Eigen::Index i = 0; i < order_; ++i) {
      const double p = std::exp(-rates(i) * period_s);
      for (Eigen::Index j = order_; j > 0; --j) denominator(j) -= p * denominator(j - 1);
    }
    a_ = denominator.tail(order_).cwiseAbs();
    b_ = Eigen::VectorXd::Zero(order_);
    for (Eigen::Index k = 0; k < order_; ++k) {
      for (Eigen::Index j = 0; j <= k; ++j) b_(k) += denominator(j) * response_(k - j);
    }
  }

  // Rounding to the nearest is not always the best: a neighbour's DC gain may be nearer.
  std::optional<Direct> best() const {
    std::optional<Direct> out;
    constexpr int kReach = 2;
    constexpr int kSide = 2 * kReach + 1;
    int neighbours = 1;
    for (Eigen::Index i = 0; i < order_; ++i) neighbours *= kSide;
    for (int neighbour = 0; neighbour < neighbours; ++neighbour) {
      std::array<int, compensator::kMaxOrder> away{};
      for (int i = 0, rest = neighbour; i < static_cast<int>(order_); ++i, rest /= kSide) {
        away[static_cast<std::size_t>(i)] = rest % kSide - kReach;
      }
      const auto one = integers(away);
      if (one && one->error_deg <= kFixedError_deg && (!out || one->error_deg < out->error_deg)) out = one;
    }
    return out;
  }

 private:
  static constexpr double kOutputStep = 1.0 / (1 << core::kOutputFraction);

  // What rounding to the input's steps takes from an edge.
  static double off_step(double edge) {
    const double steps = std::ldexp(edge, core::kInputFraction);
    return std::ldexp(std::abs(steps - std::round(steps)), -core::kInputFraction);
  }

  // What rounding takes from the gain that the first sample sees.
  static double off_gain(const Channel& channel) {
    constexpr int kUp = core::kStateFraction - core::kInputFraction;
    const double gain = channel.lti.gain;
    const int fraction =
        kUp + best_fraction(channel, "gain of the lti block", std::ldexp(gain, kUp), -16, 15);
    return std::abs(gain - std::ldexp(std::round(std::ldexp(gain, fraction)), -fraction));
  }

  // a is Q16, b Q15. b_0 brings what the DC gain lacks after all other roundings.
  std::optional<Direct> integers(const std::array<int, compensator::kMaxOrder>& away) const {
    Direct out{};
    Eigen::VectorXd a(order_);
    Eigen::VectorXd b(order_);
    double rest = gain_;
    for (Eigen::Index i = order_ - 1; i >= 0; --i) {
      const auto at = static_cast<std::size_t>(i);
      const double a_q16 = std::round(std::ldexp(a_(i), 16)) + away[at];
      rest += (i % 2 == 0 ? -gain_ : gain_) * std::ldexp(a_q16, -16);
      const double b_q15 = std::round(std::ldexp(i > 0 ? b_(i) : rest, 15));
      rest -= std::ldexp(b_q15, -15);
      if (!(a_q16 >= 0 && a_q16 <= UINT16_MAX && b_q15 >= 0 && b_q15 <= UINT16_MAX)) return std::nullopt;
      out.a[at] = static_cast<std::uint16_t>(a_q16);
      out.b[at] = static_cast<std::uint16_t>(b_q15);
      a(i) = std::ldexp(a_q16, -16);
      b(i) = std::ldexp(b_q15, -15);
    }
    out.error_deg = bound(a, b);
    return out;
  }

  // Every product is exact; only y is rounded, by half a step at most, and comes back through the poles. The
  // first y is off by its gain too, which is the same as so much rounding ever before. To it comes what the
  // rounded coefficients make of the worst sequence of inputs that keeps the angle below its upper limit.
  double bound(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    constexpr double kRounding = kOutputStep / 2;
    const double echoes = recursion(Eigen::VectorXd::Ones(1), a, kMemory).cwiseAbs().sum();
    const double start = std::max(0.0, (kRounding + start_deg_) / echoes - kRounding) * (echoes - 1);
    const Eigen::VectorXd deviation = recursion(b, a, kMemory) - response_;
    return kRounding * echoes + start + edge_deg_ +
           std::max(largest_sum(deviation, response_, top_, upper_),
                    largest_sum(-deviation, response_, top_, upper_));
  }

  double gain_;
  double top_;
  double upper_;
  double edge_deg_;   // by the dead zone's edges
  double start_deg_;  // of the first y
  Eigen::Index order_;
  ZeroOrderHold hold_;
  Eigen::VectorXd response_;
  Eigen::VectorXd a_;
  Eigen::VectorXd b_;
};

}  // namespace

std::optional<Direct> direct_form(const Channel& channel, double period_s) {
  const Lti& lti = channel.lti;
  if (!is_plain_chain(channel) || lti.gain <= 0 || after_dead_zone(channel).min < 0) return std::nullopt;
  Eigen::VectorXd rates(order_at(lti, period_s));
  double echoes = 1;
  for (Eigen::Index i = 0; i < rates.size(); ++i) {
    rates(i) = -lti.poles_rad_s[static_cast<std::size_t>(i)];
    echoes /= 1 - std::exp(-rates(i) * period_s);
  }
  if (std::ldexp(echoes, -core::kOutputFraction - 1) > kFixedError_deg) return std::nullopt;  // most chains
  return DirectSearch(channel, rates, period_s).best();
}

int refinement(const Channel& channel) {
  if (!channel.input_curve) return 0;
  double margin = 1;
  double widest = 0;
  for (std::size_t j = 0; channel.hysteresis && j < channel.hysteresis->radii.size(); ++j) {
    widest = std::max(widest, channel.hysteresis->radii[j]);
    margin += std::abs(channel.hysteresis->weights[j]) * channel.hysteresis->radii[j];
  }
  const std::vector<double>& x = channel.input_curve->x;
  const double reach = std::max(std::abs(x.front()), std::abs(x.back())) + 2 * widest + margin;
  constexpr int kMost = 4;
  int bits = 0;
  while (bits < kMost && std::ldexp(reach, core::kInputFraction + bits + 1) <= 32767) ++bits;
  return bits;
}

compensator::FixedWeight fixed_weight(double value) {
  constexpr int kMaxShift = 15;
  int shift = 0;
  while (shift < kMaxShift && std::round(std::ldexp(value, 17 + shift)) <= 65535) ++shift;
  const double mantissa = std::clamp(std::round(std::ldexp(value, 16 + shift)), 0.0, 65535.0);
  return {static_cast<std::uint16_t>(mantissa), static_cast<std::uint8_t>(shift)};
}

}  // namespace flexor::model::detail
