#include "host/model/kinds.hpp"

namespace flexor::model {
namespace {

constexpr double kMaxWeight = 8;          // of a play
constexpr double kMinKnotSpacing = 1e-6;  // of the largest |x|
constexpr double kMostRise = 16383;       // between two knots, in the output's steps
constexpr double kLeastDamping = 0.01;
constexpr double kMostDamping = 0.999;

}  // namespace

Interval Sum::values(std::span<const Interval> in, double) const {
  Interval out{offset, offset};
  for (std::size_t i = 0; i < in.size(); ++i) {
    const double a = weights[i] * in[i].min;
    const double b = weights[i] * in[i].max;
    out.min += std::min(a, b);
    out.max += std::max(a, b);
  }
  return out;
}

// No finer than the sum itself can be: terms of one fraction add up without a product.
Need Sum::need(const FixedSignal& in, const Need& out) const {
  int most = kMostFraction;
  while (most > -kMostFraction && std::ldexp(out.values.magnitude(), most) > INT16_MAX) --most;
  return {in.values, kMostFraction, false, most};
}

Sum::Fixed Sum::fixed(const FixedBlock& block) const {
  constexpr double kLimit = 1 << 30;
  for (int shift = 15; shift >= 1; --shift) {
    Fixed c{};
    c.count = static_cast<std::uint8_t>(weights.size());
    c.shift = static_cast<std::uint8_t>(shift);
    const double scaled_offset = std::round(std::ldexp(offset, block.out.fraction + shift));
    double reach = std::abs(scaled_offset) + std::ldexp(1.0, shift - 1);
    bool fits = true;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const FixedSignal& in = block.in[i];
      const double w = std::round(std::ldexp(weights[i], block.out.fraction - in.fraction + shift));
      fits = fits && std::abs(w) <= 32767;
      if (!fits) break;
      c.weight[i] = static_cast<std::int16_t>(w);
      reach += std::abs(w) * std::min(32768.0, std::ldexp(in.values.magnitude(), in.fraction) + 1);
    }
    if (!fits || reach >= kLimit) continue;
    c.offset = static_cast<std::int32_t>(scaled_offset);
    return c;
  }
  block.does_not_fit("its weights and offset");
}

void Curve::check(const Place& place) const {
  place.readings(x);
  place.readings(y);
  place.require(x.size() == y.size(), "x and y must have as many elements");
  place.require(x.size() >= 2 && x.size() <= kMaxKnots, fmt::format("must have 2 to {} knots", kMaxKnots));
  const bool increasing = std::ranges::adjacent_find(x, std::greater_equal<>()) == x.end();
  place.require(increasing, "x must be strictly increasing");
  place.require(x.back() - x.front() >= kMinRange, fmt::format("x must range over {:g} at least", kMinRange));
  const double least = kMinKnotSpacing * std::max(std::abs(x.front()), std::abs(x.back()));
  for (std::size_t i = 1; i < x.size(); ++i) {
    place.require(
        x[i] - x[i - 1] >= least,
        fmt::format("the knots at {:.9g} and {:.9g} must be at least {:.3g} apart", x[i - 1], x[i], least));
  }
}

Interval Curve::values(std::span<const Interval> in, double) const {
  const double from = std::clamp(in[0].min, x.front(), x.back());
  const double to = std::clamp(in[0].max, x.front(), x.back());
  const Floating<double> f = floating<double>(0);
  Interval out{std::min(f(from), f(to)), std::max(f(from), f(to))};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] > from && x[i] < to) out = hull(out, {y[i], y[i]});
  }
  return out;
}

int Curve::most_fraction() const {
  const double height = Interval{std::ranges::min(y), std::ranges::max(y)}.magnitude();
  double rise = 0;
  for (std::size_t i = 1; i < y.size(); ++i) rise = std::max(rise, std::abs(y[i] - y[i - 1]));
  int most = kMostFraction;
  while (most > -kMostFraction && (std::ldexp(rise, most) > kMostRise || std::ldexp(height, most) > 32767))
    --most;
  return most;
}

Curve::Fixed Curve::fixed(const FixedBlock& block) const {
  const int from = block.in[0].fraction;
  const int to = block.out.fraction;
  // A knot between two steps of the input moves to the nearer, along the curve: only its corner is cut.
  std::vector<std::int16_t> at;
  for (const double knot : x) {
    const double limit = std::ldexp(32767.0, -from);
    const std::int16_t step = block.number("a knot", std::clamp(knot, -limit, limit), from);
    if (at.empty() || step > at.back()) at.push_back(step);
  }
  if (at.size() < 2) block.does_not_fit("the range of its knots");
  Fixed c{};
  c.knots.count = static_cast<std::uint8_t>(at.size());
  const Floating<double> f = floating<double>(0);
  for (std::size_t i = 0; i < at.size(); ++i) {
    c.knots.x[i] = at[i];
    c.knots.scale[i] = 1;
    c.values.at[i].y = block.number("its value", f(std::ldexp(at[i], -from)), to);
  }
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const auto width = static_cast<std::uint16_t>(at[i + 1] - at[i]);
    c.knots.scale[i] = compensator::scale_of(width);
    c.values.at[i].slope =
        compensator::slope_of(static_cast<std::int16_t>(c.values.at[i + 1].y - c.values.at[i].y),
                              static_cast<std::uint16_t>(width * c.knots.scale[i]));
  }
  return c;
}

void Hysteresis::check(const Place& place) const {
  place.readings(radii);
  place.require(radii.size() == weights.size(), "radii and weights must have as many elements");
  place.require(radii.size() >= 1 && radii.size() <= kMaxPlays,
                fmt::format("must have 1 to {} plays", kMaxPlays));
  place.require(std::ranges::all_of(radii, [](double r) { return r >= 0; }), "radii must not be negative");
  place.require(std::ranges::all_of(weights, [](double w) { return std::abs(w) < kMaxWeight; }),
                "weights must lie between -8 and 8");
}

double Hysteresis::reach() const {
  double sum = 0;
  for (std::size_t j = 0; j < radii.size(); ++j) sum += std::abs(weights[j]) * radii[j];
  return sum;
}

Need Hysteresis::need(const FixedSignal& in, const Need& out) const {
  const double margin = reach() + 2 * std::ranges::max(radii) + 1;
  const Interval around = {out.values.min - margin, out.values.max + margin};
  return {hull(meet(in.values, around), out.values), kMostFraction, true};
}

Hysteresis::Fixed Hysteresis::fixed(const FixedBlock& block) const {
  Fixed c{};
  c.plays.count = static_cast<std::uint8_t>(radii.size());
  for (std::size_t j = 0; j < radii.size(); ++j) {
    c.plays.radius[j] = block.number("the radius of a play", radii[j], block.in[0].fraction);
    c.weight[j] = block.number("the weight of a play", weights[j], compensator::kHysteresisWeightFraction);
  }
  return c;
}

void PolePair::check(const Place& place) const {
  place.rate(frequency_rad_s, "frequency_rad_s");
  place.require(frequency_rad_s * place.period_s >= 1e-4, "so slow a pair needs a longer sample period");
  place.require(damping >= kLeastDamping && damping <= kMostDamping,
                fmt::format("the damping must lie between {} and {}; real poles are an \"lti\"",
                            kLeastDamping, kMostDamping));
  place.require(taps.size() == 2 && std::abs(taps[0]) <= kMaxTap && std::abs(taps[1]) <= kMaxTap,
                fmt::format("there must be two taps, between -{0:g} and {0:g}", kMaxTap));
}

// Cosine and sine of an angle above 0, by arithmetic alone: a model has the same bits everywhere, and the system's differ in a last
// digit between Windows and Linux. e^{ix} - 1 by its series where x is small, and from there by doubling the angle.
static std::pair<double, double> cosine_and_sine(double x) {
  int halved = 0;
  for (; x > 0.125; ++halved) x /= 2;
  const double x2 = x * x;
  double c = -x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30 * (1 - x2 / 56 * (1 - x2 / 90))));
  double s = x * (1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72))));
  for (; halved > 0; --halved) {
    const double turned = c * (2 + c) - s * s;
    s *= 2 * (1 + c);
    c = turned;
  }
  return {1 + c, s};
}

// exp of the companion matrix: e^{-zeta q} (cos + ...), q = omega T, d = q sqrt(1 - zeta^2).
std::array<double, 4> PolePair::transition(double period_s) const {
  const double q = frequency_rad_s * period_s;
  const double d = q * std::sqrt(1 - damping * damping);
  const double decay = std::exp(-damping * q);
  const auto [cosine, sine] = cosine_and_sine(d);
  const double c = decay * cosine;
  const double s = decay * sine * q / d;
  return {c + damping * s, s, -s, c - damping * s};
}

// Sums of |response| to a single sample of 1, which is a jump up and then one down: of e, and of the output. What
// comes after kLong samples is bounded by its envelope.
PolePair::Reach PolePair::reach(double period_s) const {
  constexpr int kLong = 4096;
  constexpr double kForgotten = 1e-9;
  const auto t = transition(period_s);
  const double decay = std::exp(-damping * frequency_rad_s * period_s);
  const double weight = std::abs(1 - taps[0]) + std::abs(taps[1]);
  Reach sum;
  double e0 = 0;
  double e1 = 0;
  double envelope = 2 / std::sqrt(1 - damping * damping);
  for (int k = 0; k < kLong && envelope > kForgotten; ++k) {
    const double jump = k == 0 ? 1 : (k == 1 ? -1 : 0);
    const double before = e0 - jump;
    e0 = t[0] * before + t[1] * e1;
    e1 = t[2] * before + t[3] * e1;
    sum.state += std::max(std::abs(e0), std::abs(e1));
    sum.output += std::abs((k == 0 ? 1 : 0) + (1 - taps[0]) * e0 + taps[1] * e1);
    if (k > 0) envelope *= decay;
  }
  const double rest =
      2 * std::max(std::abs(e0), std::abs(e1)) / (1 - decay) * (2 / std::sqrt(1 - damping * damping));
  sum.state += rest;
  sum.output += weight * rest;
  return sum;
}

// Around the middle of its input, since its DC gain is 1.
Interval PolePair::values(std::span<const Interval> in, double period_s) const {
  const double middle = in[0].min + in[0].width() / 2;
  const double margin = reach(period_s).output * in[0].width() / 2;
  return {middle - margin, middle + margin};
}

PolePair::Fixed PolePair::fixed(const FixedBlock& block) const {
  const FixedSignal& in = block.in[0];
  const double most = std::max(reach(block.period_s).state * in.values.width(),
                               values({{in.values}}, block.period_s).magnitude());
  Fixed c{};
  int up = 14;
  while (up >= 0 && std::ldexp(most, in.fraction + up) >= 1 << 30) --up;
  const int down = in.fraction + up - block.out.fraction;
  if (up < 0 || down < 1) block.does_not_fit("its signal");
  c.up = static_cast<std::uint8_t>(up);
  c.down = static_cast<std::uint8_t>(down);
  std::array<double, 4> change = transition(block.period_s);
  change[0] -= 1;
  change[3] -= 1;
  double most_change = 0;
  for (const double one : change) most_change = std::max(most_change, std::abs(one));
  c.change_fraction = static_cast<std::uint8_t>(block.fraction("its transition", most_change, 1, 28));
  for (std::size_t i = 0; i < change.size(); ++i) {
    c.change[i] = block.number("its transition", change[i], c.change_fraction);
  }
  const double weights[] = {1 - taps[0], taps[1]};
  c.tap_fraction = static_cast<std::uint8_t>(
      block.fraction("a tap", std::max(std::abs(weights[0]), std::abs(weights[1])), 1, 15));
  for (int i = 0; i < 2; ++i) c.tap[i] = block.number("a tap", weights[i], c.tap_fraction);
  return c;
}

}  // namespace flexor::model
