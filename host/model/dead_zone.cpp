#include "host/model/dead_zone.hpp"

#include <algorithm>

namespace flexor::model {

void DeadZone::check(const Place& place) const {
  place.readings({{lower, upper}});
  place.require(lower <= upper, "lower must not exceed upper");
}

Interval DeadZone::values(std::span<const Interval> in, double) const {
  const compensator::DeadZone<double> zone{lower, upper};
  return {zone(in[0].min), zone(in[0].max)};
}

// The same step serves input and output: both must fit.
Need DeadZone::need(const FixedSignal& in, const Need& out) const {
  return {hull(in.values, values({{in.values}}, 0)), kMostFraction, out.finer};
}

DeadZone::Fixed DeadZone::fixed(const FixedBlock& block) const {
  const int fraction = block.in[0].fraction;
  (void)block.number("its signal", values({{block.in[0].values}}, 0).magnitude(), fraction);
  // An edge beyond all int16 is never passed, unless the zone lies there altogether.
  const double most = std::ldexp(32767, -fraction);
  return {block.number("lower", upper < -most ? lower : std::max(lower, -most), fraction),
          block.number("upper", lower > most ? upper : std::min(upper, most), fraction)};
}

Source DeadZone::source(const Fixed& c) {
  return {"DeadZone<int16_t>", fmt::format("{{{}, {}}}", c.lower, c.upper)};
}

}  // namespace flexor::model
