#include "host/model/coefficients.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model::detail {

PaddedLti pad(const Lti& lti, double period_s, int order) {
  PaddedLti out{Eigen::VectorXd::Zero(order), Eigen::MatrixXd::Zero(order, order),
                Eigen::VectorXd::Zero(order)};
  const auto n = static_cast<Eigen::Index>(lti.poles_rad_s.size());
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

void check_capacity(const Channel& channel, int plays, int input_knots, int order, int output_knots,
                    bool taps) {
  const auto need = [&](std::size_t size, int capacity, const char* what) {
    if (size > static_cast<std::size_t>(capacity)) {
      throw io::InputError(
          fmt::format("channel {}: needs {} {}, the shape has {}", channel.name, size, what, capacity));
    }
  };
  need(channel.hysteresis ? channel.hysteresis->radii.size() : 0, plays, "plays");
  need(channel.input_curve ? channel.input_curve->x.size() : 0, input_knots, "knots");
  need(channel.lti.poles_rad_s.size(), order, "poles");
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

compensator::FixedWeight fixed_weight(double value) {
  constexpr int kMaxShift = 15;
  int shift = 0;
  while (shift < kMaxShift && std::round(std::ldexp(value, 17 + shift)) <= 65535) ++shift;
  const double mantissa = std::clamp(std::round(std::ldexp(value, 16 + shift)), 0.0, 65535.0);
  return {static_cast<std::uint16_t>(mantissa), static_cast<std::uint8_t>(shift)};
}

}  // namespace flexor::model::detail
