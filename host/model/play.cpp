#include "host/model/play.hpp"

namespace flexor::model {

void Play::check(const Place& place) const {
  place.readings({{radius}});
  place.require(radius >= 0, "the radius must not be negative");
}

Interval Play::values(std::span<const Interval> in, double) const { return in[0]; }

// Where saturating changes nothing: what the play still remembers lies up to a diameter beyond what is needed
// of its output.
Need Play::need(const FixedSignal&, const Need& out) const {
  const double margin = 2 * radius + 1;
  return {{out.values.min - margin, out.values.max + margin}, kMostFraction, true};
}

// A radius that the input never reaches is as good as any larger one.
Play::Fixed Play::fixed(const FixedBlock& block) const {
  return {block.number("radius", std::min(radius, block.in[0].values.width()), block.in[0].fraction)};
}

Source Play::source(const Fixed& c) { return {"Play<int16_t>", fmt::format("{{{}}}", c.radius)}; }

}  // namespace flexor::model
