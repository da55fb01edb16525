#include "host/model/lti.hpp"

#include <algorithm>
#include <cmath>

#include "host/model/kinds.hpp"

namespace flexor::model {
namespace {

constexpr double kForgotten = 1e-9;

Interval scaled(const Lti& lti, const Interval& in) { return Gain{lti.gain, lti.offset}.values({{in}}, 0); }

// As many as are left at this period: the last is dropped where a sample forgets it altogether, since its state then equals the
// one before.
Eigen::VectorXd rates_of(const Lti& lti, double period_s) {
  const auto n = std::ssize(lti.poles_rad_s);
  const bool is_forgotten = n > 1 && std::exp(lti.poles_rad_s.back() * period_s) < kForgotten;
  return -Eigen::Map<const Eigen::VectorXd>(lti.poles_rad_s.data(), is_forgotten ? n - 1 : n);
}

// The gain is m / 2^shift relative to the change of fraction from the input's to Q20; the largest shift for
// which m fits int16. 99 where none does.
int gain_shift(double gain, int fraction) {
  const int up = core::kStateFraction - fraction;
  for (int shift = 15; shift >= -16; --shift) {
    if (std::round(std::ldexp(std::abs(gain), up + shift)) <= 32767) return shift;
  }
  return 99;
}

}  // namespace

void Lti::check(const Place& place) const {
  place.require(std::abs(gain) <= kMaxGain && std::abs(offset) <= kMaxGain,
                fmt::format("gain and offset must lie between -{0:g} and {0:g}", kMaxGain));
  place.require(poles_rad_s.size() <= compensator::kMaxOrder, "at most three poles");
  for (const double pole : poles_rad_s) {
    place.require(pole < 0, "poles must be negative (stable)");
    place.rate(-pole, "a pole's rate");
  }
  place.require(taps.empty() || taps.size() == poles_rad_s.size(), "taps must be empty or one for each pole");
  place.require(std::ranges::all_of(taps, [](double tap) { return std::abs(tap) <= kMaxTap; }),
                fmt::format("taps must lie between -{0:g} and {0:g}", kMaxTap));
}

// States are means of the scaled input; taps weigh differences of states.
Interval Lti::values(std::span<const Interval> in, double) const {
  const Interval w = scaled(*this, in[0]);
  double reach = 0;
  for (const double tap : taps) reach += std::abs(tap) * w.width();
  return {w.min - reach, w.max + reach};
}

Lti::Padded Lti::padded_at(double period_s) const {
  Padded out;
  const Eigen::VectorXd rates = rates_of(*this, period_s);
  const Eigen::Index n = rates.size();
  if (n == 0) {
    out.tap(0) = 1;  // y = w
    return out;
  }
  const ZeroOrderHold hold = zero_order_hold(rates, period_s);
  out.input_weight.tail(n) = hold.input;
  out.chain_weight.bottomRightCorner(n, n).triangularView<Eigen::StrictlyLower>() = hold.transition;
  if (taps.empty()) return out;
  out.tap(0) = taps[0];
  out.tap.tail(n - 1) = Eigen::Map<const Eigen::VectorXd>(taps.data() + 1, n - 1);
  return out;
}

namespace detail {
namespace {

// What is left of anything after so many samples is not visible: direct forms forget within a few.
constexpr Eigen::Index kMemory = 64;

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
  DirectSearch(double gain, const Eigen::VectorXd& rates, double top, double upper_deg, double period_s)
      : gain_(gain),
        top_(top),
        upper_(std::max(upper_deg, 0.0) + kOutputStep),
        start_deg_(top * off_gain(gain)),
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
  static constexpr int kUp = core::kStateFraction - core::kInputFraction;

  // What rounding takes from the gain that the first sample sees.
  static double off_gain(double gain) {
    const int fraction = kUp + gain_shift(gain, core::kInputFraction);
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
    return kRounding * echoes + start +
           std::max(largest_sum(deviation, response_, top_, upper_),
                    largest_sum(-deviation, response_, top_, upper_));
  }

  double gain_;
  double top_;
  double upper_;
  double start_deg_;  // of the first y
  Eigen::Index order_;
  ZeroOrderHold hold_;
  Eigen::VectorXd response_;
  Eigen::VectorXd a_;
  Eigen::VectorXd b_;
};

}  // namespace

std::optional<Direct> direct_form(const Lti& lti, double top, double upper_deg, double period_s) {
  const bool plain = lti.offset == 0 && lti.gain > 0 && !lti.poles_rad_s.empty() &&
                     std::ranges::all_of(lti.taps, [](double tap) { return tap == 0; });
  if (!plain) return std::nullopt;
  const Eigen::VectorXd rates = rates_of(lti, period_s);
  double echoes = 1;
  for (const double rate : rates) echoes /= 1 - std::exp(-rate * period_s);
  if (std::ldexp(echoes, -core::kOutputFraction - 1) > kFixedError_deg) return std::nullopt;  // most chains
  return DirectSearch(lti.gain, rates, top, upper_deg, period_s).best();
}

}  // namespace detail

Lti::Fixed Lti::fixed(const FixedBlock& block) const {
  // Q20 in int32 holds |value| < 2048, for every state and for every difference of two.
  constexpr double kStateLimit = 2047;
  const FixedSignal& in = block.in[0];
  const Interval w = scaled(*this, in.values);
  if (w.width() >= kStateLimit || std::abs(offset) + w.magnitude() >= kStateLimit ||
      values({{in.values}}, block.period_s).magnitude() >= kStateLimit) {
    block.does_not_fit("its signal");
  }
  const int shift = gain_shift(gain, in.fraction);
  if (shift > 15) block.does_not_fit(fmt::format("its gain ({:.6g})", gain));
  Fixed c{};
  c.gain = block.number("its gain", gain, core::kStateFraction - in.fraction + shift);
  c.gain_shift = static_cast<std::int8_t>(shift);
  c.offset = static_cast<std::int32_t>(std::lround(std::ldexp(offset, core::kStateFraction)));
  c.output_shift = static_cast<std::uint8_t>(core::kStateFraction - block.out.fraction);
  const Padded padded = padded_at(block.period_s);
  c.tap_fraction =
      static_cast<std::uint8_t>(block.fraction("a tap", padded.tap.cwiseAbs().maxCoeff(), 1, 15));
  for (int i = 0; i < kOrder; ++i) {
    c.input_weight[i] = weight(padded.input_weight(i));
    c.tap[i] = block.number("a tap", padded.tap(i), c.tap_fraction);
    for (int j = 0; j < i; ++j) {
      c.chain_weight[compensator::chain_index(i, j)] = weight(padded.chain_weight(i, j));
    }
  }
  const bool usual = in.fraction == core::kInputFraction && block.out.fraction == core::kOutputFraction;
  if (!usual || in.values.min < 0) return c;
  if (const auto direct = detail::direct_form(*this, in.values.max, block.out.values.max, block.period_s)) {
    c.is_direct = true;
    std::copy_n(direct->b.begin(), kOrder, c.direct.b);
    std::copy_n(direct->a.begin(), kOrder, c.direct.a);
  }
  return c;
}

}  // namespace flexor::model
