#include "host/model/play.hpp"

#include "host/model/lti.hpp"

namespace flexor::model {
namespace {

void check_radius(const Place& place, double radius) {
  place.readings({{radius}});
  place.require(radius >= 0, "the radius must not be negative");
}

// Where saturating changes nothing: what the play still remembers lies up to a diameter beyond what is needed
// of its output.
Need around(double radius, const Need& out) {
  const double margin = 2 * radius + 1;
  return {{out.values.min - margin, out.values.max + margin}, kMostFraction, true};
}

// A radius that the input never reaches is as good as any larger one.
double reached(double radius, const FixedBlock& block) {
  return std::min(radius, block.in[0].values.width());
}

}  // namespace

void Play::check(const Place& place) const { check_radius(place, radius); }
Interval Play::values(std::span<const Interval> in, double) const { return in[0]; }
Need Play::need(const FixedSignal&, const Need& out) const { return around(radius, out); }

Play::Fixed Play::fixed(const FixedBlock& block) const {
  return {block.number("radius", reached(radius, block), block.in[0].fraction)};
}

Source Play::source(const Fixed& c) { return {"Play<int16_t>", fmt::format("{{{}}}", c.radius)}; }
void Creep::check(const Place& place) const {
  check_radius(place, radius);
  check_rate(place, rate_rad_s, "rate_rad_s");
}

Interval Creep::values(std::span<const Interval> in, double) const { return in[0]; }
Need Creep::need(const FixedSignal&, const Need& out) const { return around(radius, out); }
double Creep::share(double period_s) const { return -std::expm1(-rate_rad_s * period_s); }

Creep::Fixed Creep::fixed(const FixedBlock& block) const {
  const double wide = std::round(std::ldexp(reached(radius, block), block.in[0].fraction + Fixed::kUp));
  return {static_cast<std::int32_t>(wide), weight(share(block.period_s))};
}

Source Creep::source(const Fixed& c) {
  return {"FixedCreep", fmt::format("{{{}L, {{{}, {}}}}}", c.radius, c.share.mantissa, c.share.shift)};
}

}  // namespace flexor::model
