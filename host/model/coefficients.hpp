// Document -> runtime coefficients, in floating or fixed point. All of it in double, on the host.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "host/io/io.hpp"
#include "host/model/discrete.hpp"
#include "host/model/model.hpp"
#include "runtime/compensator/channel.hpp"

namespace flexor::model {

// Large enough for every document.
using AnyShape = compensator::Shape<kMaxPlays, kMaxKnots, compensator::kMaxOrder, kMaxKnots>;

// The most that fixed point may be from double on the same input in Q5: one step of the output, 1/16 degree.
// An input between two steps of Q5 is rounded first, by 1/64 of its unit at most, and takes the chain's slope
// times that on top; so does a dead zone's edge between two steps, where the chain has no direct form.
inline constexpr double kFixedError_deg = 0.0625;

namespace detail {

// The LTI block padded in front to `order` states: a chain of n < order lags uses the last n states, the
// others stay at their start value and have no weight.
struct PaddedLti {
  Eigen::VectorXd input_weight;  // order
  Eigen::MatrixXd chain_weight;  // order x order, strictly lower
  Eigen::VectorXd tap;           // order
};

PaddedLti pad(const Lti& lti, double period_s, int order);

// Poles that are left at this period: the last one is dropped where a sample forgets it altogether, since its
// state then equals the one before.
Eigen::Index order_at(const Lti& lti, double period_s);

// Coefficients of compensator::DirectForm and the most that it can be from double, degrees: for every
// sequence of inputs in Q5 that the channel accepts. None where that exceeds kFixedError_deg, or where the
// channel has what the form cannot do. The same bound keeps the form's angle, which has no sign, from falling
// below zero.
struct Direct {
  std::array<std::uint16_t, compensator::kMaxOrder> b{};
  std::array<std::uint16_t, compensator::kMaxOrder> a{};
  double error_deg = 0;
};
std::optional<Direct> direct_form(const Channel& channel, double period_s);

// Throws io::InputError when `channel` needs more than the shape has.
void check_capacity(const Channel& channel, double period_s, int plays, int input_knots, int order,
                    int output_knots, bool taps);

// Range of the signal after each block for inputs in [valid_min, valid_max]; what fixed point must hold.
struct Interval {
  double min;
  double max;
  double magnitude() const { return std::max(std::abs(min), std::abs(max)); }
};
Interval after_dead_zone(const Channel& channel);
Interval after_hysteresis(const Channel& channel);
Interval after_input_curve(const Channel& channel);
Interval after_gain(const Channel& channel);
// Bound of |y| of the LTI block: states are means of inputs, taps weigh differences of states.
double lti_bound(const Channel& channel);

[[noreturn]] void does_not_fit(const Channel& channel, const std::string& what);

// round(value * 2^fraction); throws when it does not fit int16.
std::int16_t quantise(const Channel& channel, const char* what, double value, int fraction);

// Largest fraction in [low, high] for which |magnitude| * 2^fraction fits int16; throws when there is none.
int best_fraction(const Channel& channel, const char* what, double magnitude, int low, int high);

compensator::FixedWeight fixed_weight(double value);

// Fraction bits beyond Q5 that hysteresis and curve may have: as many as hold the curve's knots, and beyond
// them what a play still remembers, so that saturating there changes no output. 0 without a curve.
int refinement(const Channel& channel);

template <class RuntimeCurve>
void fill_floating(const Curve& curve, RuntimeCurve& out) {
  using Real = std::remove_reference_t<decltype(out.x[0])>;
  out.count = static_cast<std::uint8_t>(curve.x.size());
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const bool last = i + 1 == curve.x.size();
    out.x[i] = static_cast<Real>(curve.x[i]);
    out.y[i] = static_cast<Real>(curve.y[i]);
    out.slope[i] =
        last ? Real{0} : static_cast<Real>((curve.y[i + 1] - curve.y[i]) / (curve.x[i + 1] - curve.x[i]));
  }
}

// x_fraction: of the knots and the input. Returns the fraction bits of the curve's output.
template <class RuntimeCurve>
int fill_fixed(const Channel& channel, const Curve& curve, int x_fraction, int min_fraction,
               RuntimeCurve& out) {
  double value = 0;
  double slope = 0;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    value = std::max(value, std::abs(curve.y[i]));
    if (i == 0) continue;
    slope = std::max(slope, std::abs((curve.y[i] - curve.y[i - 1]) / (curve.x[i] - curve.x[i - 1])));
  }
  int fraction = best_fraction(channel, "curve", value, min_fraction, 13);
  // A steep curve gives up fraction bits until its slope fits.
  const auto slope_at = [&](int f) { return std::ldexp(slope, f - x_fraction); };
  while (fraction > min_fraction && slope_at(fraction) * 2 > 32767) --fraction;
  const int shift = best_fraction(channel, "slope of the curve", slope_at(fraction), 1, 14);
  out.count = static_cast<std::uint8_t>(curve.x.size());
  out.slope_shift = static_cast<std::uint8_t>(shift);
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const bool last = i + 1 == curve.x.size();
    out.x[i] = quantise(channel, "knot of the curve", curve.x[i], x_fraction);
    out.y[i] = quantise(channel, "value of the curve", curve.y[i], fraction);
    const double s = last ? 0 : (curve.y[i + 1] - curve.y[i]) / (curve.x[i + 1] - curve.x[i]);
    out.slope[i] = quantise(channel, "slope of the curve", s, fraction - x_fraction + shift);
  }
  return fraction;
}

// The linear block's gain, offset and poles; `fraction` is that of its input.
template <class ShapeT, class Lti>
void fill_fixed_lti(const Channel& channel, double period_s, int fraction, Lti& c) {
  // Q20 in int32 holds |value| < 2048, for every state and for every difference of two.
  constexpr double kStateLimit = 2047;
  const Interval w = after_gain(channel);
  if (w.max - w.min >= kStateLimit || std::abs(channel.lti.offset) + w.magnitude() >= kStateLimit ||
      lti_bound(channel) >= kStateLimit) {
    does_not_fit(channel, "signal of the lti block");
  }
  // gain = m / 2^shift relative to the change of fraction from the input's to Q20.
  const int up = core::kStateFraction - fraction;
  const int shift =
      best_fraction(channel, "gain of the lti block", std::ldexp(channel.lti.gain, up), -16, 15);
  c.gain = quantise(channel, "gain of the lti block", channel.lti.gain, up + shift);
  c.gain_shift = static_cast<std::int8_t>(shift);
  c.offset = static_cast<std::int32_t>(std::lround(std::ldexp(channel.lti.offset, core::kStateFraction)));
  if constexpr (ShapeT::kOrder > 0) {
    const auto padded = pad(channel.lti, period_s, ShapeT::kOrder);
    c.tap_fraction = static_cast<std::uint8_t>(
        best_fraction(channel, "tap of the lti block", padded.tap.cwiseAbs().maxCoeff(), 1, 15));
    for (int i = 0; i < ShapeT::kOrder; ++i) {
      c.input_weight[i] = fixed_weight(padded.input_weight(i));
      c.tap[i] = quantise(channel, "tap of the lti block", padded.tap(i), c.tap_fraction);
      for (int j = 0; j < i; ++j) {
        c.chain_weight[compensator::chain_index(i, j)] = fixed_weight(padded.chain_weight(i, j));
      }
    }
    if (const auto direct = direct_form(channel, period_s)) {
      c.is_direct = true;
      std::copy_n(direct->b.begin(), ShapeT::kOrder, c.direct.b);
      std::copy_n(direct->a.begin(), ShapeT::kOrder, c.direct.a);
    }
  }
}

}  // namespace detail

// Throws io::InputError when the shape is too small for the channel.
template <class Real, class ShapeT>
auto floating_coefficients(const Channel& channel, double period_s) {
  detail::check_capacity(channel, period_s, ShapeT::kPlays, ShapeT::kInputKnots, ShapeT::kOrder,
                         ShapeT::kOutputKnots, ShapeT::kTaps);
  typename compensator::Channel<compensator::Floating<Real, ShapeT>, ShapeT>::Coefficients c{};
  const auto real = [](double v) { return static_cast<Real>(v); };
  c.valid_min = real(channel.valid_min);
  c.valid_max = real(channel.valid_max);
  if (channel.dead_zone) c.dead_zone = {real(channel.dead_zone->lower), real(channel.dead_zone->upper)};
  if (channel.hysteresis) {
    c.hysteresis.plays.count = static_cast<std::uint8_t>(channel.hysteresis->radii.size());
    for (std::size_t j = 0; j < channel.hysteresis->radii.size(); ++j) {
      c.hysteresis.plays.radius[j] = real(channel.hysteresis->radii[j]);
      c.hysteresis.weight[j] = real(channel.hysteresis->weights[j]);
    }
  }
  if (channel.input_curve) detail::fill_floating(*channel.input_curve, c.input_curve);
  c.lti.gain = real(channel.lti.gain);
  c.lti.offset = real(channel.lti.offset);
  if constexpr (ShapeT::kOrder > 0) {
    const auto padded = detail::pad(channel.lti, period_s, ShapeT::kOrder);
    for (int i = 0; i < ShapeT::kOrder; ++i) {
      c.lti.input_weight[i] = real(padded.input_weight(i));
      c.lti.tap[i] = real(padded.tap(i));
      for (int j = 0; j < i; ++j) {
        c.lti.chain_weight[compensator::chain_index(i, j)] = real(padded.chain_weight(i, j));
      }
    }
  }
  if (channel.output_curve) detail::fill_floating(*channel.output_curve, c.output_curve);
  c.lower = real(channel.saturation.lower_deg);
  c.upper = real(channel.saturation.upper_deg);
  c.rest = real(channel.rest_deg);
  return c;
}

// Throws io::InputError when the shape is too small or a number does not fit the formats of
// runtime/compensator, naming the channel and the block.
template <class ShapeT>
auto fixed_coefficients(const Channel& channel, double period_s) {
  using detail::quantise;
  detail::check_capacity(channel, period_s, ShapeT::kPlays, ShapeT::kInputKnots, ShapeT::kOrder,
                         ShapeT::kOutputKnots, ShapeT::kTaps);
  typename compensator::Channel<compensator::Fixed<ShapeT>, ShapeT>::Coefficients c{};
  const int q_in = core::kInputFraction;
  c.valid_min = quantise(channel, "valid_min", channel.valid_min, q_in);
  c.valid_max = quantise(channel, "valid_max", channel.valid_max, q_in);
  if (channel.dead_zone) {
    c.dead_zone.lower = quantise(channel, "dead zone", channel.dead_zone->lower, q_in);
    c.dead_zone.upper = quantise(channel, "dead zone", channel.dead_zone->upper, q_in);
    (void)quantise(channel, "signal after the dead zone", detail::after_dead_zone(channel).magnitude(), q_in);
  }
  c.refinement = static_cast<std::uint8_t>(detail::refinement(channel));
  const int q = q_in + c.refinement;
  if (channel.hysteresis) {
    const auto& h = *channel.hysteresis;
    c.hysteresis.plays.count = static_cast<std::uint8_t>(h.radii.size());
    for (std::size_t j = 0; j < h.radii.size(); ++j) {
      c.hysteresis.plays.radius[j] = quantise(channel, "radius of a play", h.radii[j], q);
      c.hysteresis.weight[j] =
          quantise(channel, "weight of a play", h.weights[j], compensator::kHysteresisWeightFraction);
    }
    // A curve holds its ends, so that saturating before it changes nothing; without one it would.
    if (!channel.input_curve) {
      const double reach = detail::after_hysteresis(channel).magnitude();
      (void)quantise(channel, "signal after the hysteresis", reach, q_in);
    }
  }
  int fraction = q_in;
  if (channel.input_curve) fraction = detail::fill_fixed(channel, *channel.input_curve, q, 0, c.input_curve);
  detail::fill_fixed_lti<ShapeT>(channel, period_s, fraction, c.lti);
  if (channel.output_curve) {
    (void)quantise(channel, "input of the output curve", detail::lti_bound(channel), q_in);
    const int out =
        detail::fill_fixed(channel, *channel.output_curve, q_in, core::kOutputFraction, c.output_curve);
    c.output_curve_shift = static_cast<std::uint8_t>(out - core::kOutputFraction);
  }
  c.lower = quantise(channel, "saturation", channel.saturation.lower_deg, core::kOutputFraction);
  c.upper = quantise(channel, "saturation", channel.saturation.upper_deg, core::kOutputFraction);
  c.rest = quantise(channel, "rest_deg", channel.rest_deg, core::kOutputFraction);
  return c;
}

}  // namespace flexor::model
