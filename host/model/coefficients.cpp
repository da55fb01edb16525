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

std::optional<Direct> direct_form(const Channel& channel, double period_s) {
  const Lti& lti = channel.lti;
  const Eigen::Index n = order_at(lti, period_s);
  const bool plain = !channel.hysteresis && !channel.input_curve && !channel.output_curve &&
                     lti.offset == 0 && std::ranges::all_of(lti.taps, [](double tap) { return tap == 0; });
  if (n == 0 || !plain || lti.gain <= 0 || after_dead_zone(channel).min < 0) return std::nullopt;
  // prod (1 - p_i / z), then b from the first n values of the impulse response of the hold.
  Direct out{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  Eigen::VectorXd denominator = Eigen::VectorXd::Unit(n + 1, 0);
  double gain_of_rounding = 1;
  Eigen::VectorXd rates(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    rates(i) = -lti.poles_rad_s[static_cast<std::size_t>(i)];
    const double p = std::exp(-rates(i) * period_s);
    for (Eigen::Index j = n; j > 0; --j) denominator(j) -= p * denominator(j - 1);
    gain_of_rounding /= 1 - p;
  }
  constexpr double kLargestGain = 1.85;  // of half a step of Q4: 0.058 degree
  if (gain_of_rounding > kLargestGain) return std::nullopt;
  const ZeroOrderHold hold = zero_order_hold(rates, period_s);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd response(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double w = k == 0 ? lti.gain : 0;
    const Eigen::VectorXd old = x;
    for (Eigen::Index i = 0; i < n; ++i) {
      x(i) += hold.input(i) * (w - old(i));
      for (Eigen::Index j = 0; j < i; ++j) x(i) += hold.transition(i, j) * (old(j) - old(i));
    }
    response(k) = x(n - 1);
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index j = 0; j <= k; ++j) out.b(k) += denominator(j) * response(k - j);
    out.a(k) = std::abs(denominator(k + 1));
  }
  const bool fits = out.b.minCoeff() >= 0 && out.b.maxCoeff() < 1.99996 && out.a.maxCoeff() < 0.99999;
  return fits ? std::optional(out) : std::nullopt;
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
