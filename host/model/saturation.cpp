#include "host/model/saturation.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {

void Saturation::check(const Place& place) const {
  place.require(std::abs(lower_deg) <= kMaxAngle_deg && std::abs(upper_deg) <= kMaxAngle_deg,
                fmt::format("must lie within {:g} degrees either way", kMaxAngle_deg));
  place.require(lower_deg < upper_deg, "lower_deg must be below upper_deg");
}

Interval Saturation::values(std::span<const Interval> in, double) const {
  return {std::clamp(in[0].min, lower_deg, upper_deg), std::clamp(in[0].max, lower_deg, upper_deg)};
}

// Beyond the limits one step is as good as any.
Need Saturation::need(const FixedSignal&, const Need& out) const {
  return {{lower_deg, upper_deg}, out.fraction, out.finer};
}

Saturation::Fixed Saturation::fixed(const FixedBlock& block) const {
  const int fraction = block.in[0].fraction;
  // A limit that no int16 reaches limits nothing.
  const double most = std::ldexp(32767, -fraction);
  const auto limit = [&](const char* what, double deg) {
    return block.number(what, std::clamp(deg, -most, most), fraction);
  };
  return {limit("lower_deg", lower_deg), limit("upper_deg", upper_deg)};
}

Source Saturation::source(const Fixed& c) {
  return {"Saturation<int16_t>", fmt::format("{{{}, {}}}", c.lower, c.upper)};
}

}  // namespace flexor::model
