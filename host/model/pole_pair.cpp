#include "host/model/pole_pair.hpp"

#include <cmath>

#include "host/model/lti.hpp"

namespace flexor::model {
namespace {

constexpr double kLeastDamping = 0.01;
constexpr double kMostDamping = 0.999;

}  // namespace

void PolePair::check(const Place& place) const {
  check_rate(place, frequency_rad_s, "frequency_rad_s");
  place.require(frequency_rad_s * place.period_s >= 1e-4, "so slow a pair needs a longer sample period");
  place.require(damping >= kLeastDamping && damping <= kMostDamping,
                fmt::format("the damping must lie between {} and {}; real poles are an \"lti\"",
                            kLeastDamping, kMostDamping));
  place.require(taps.size() == 2 && std::abs(taps[0]) <= kMaxTap && std::abs(taps[1]) <= kMaxTap,
                fmt::format("there must be two taps, between -{0:g} and {0:g}", kMaxTap));
}

// exp of the companion matrix: e^{-zeta q} (cos + ...), q = omega T, d = q sqrt(1 - zeta^2).
std::array<double, 4> PolePair::transition(double period_s) const {
  const double q = frequency_rad_s * period_s;
  const double d = q * std::sqrt(1 - damping * damping);
  const double decay = std::exp(-damping * q);
  const double c = decay * std::cos(d);
  const double s = decay * std::sin(d) * q / d;
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

Need PolePair::need(const FixedSignal& in, const Need&) const { return {in.values, kMostFraction, false}; }

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

Source PolePair::source(const Fixed& c) {
  return {"FixedPolePair", fmt::format("{{{}, {}, {}, {}, {}, {}}}", braces(c.change, 4), c.change_fraction,
                                       braces(c.tap, 2), c.tap_fraction, c.up, c.down)};
}

}  // namespace flexor::model
