#include "host/model/hysteresis.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {
namespace {

constexpr double kMaxWeight = 8;

}  // namespace

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

Interval Hysteresis::values(std::span<const Interval> in, double) const {
  return {in[0].min - reach(), in[0].max + reach()};
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

Source Hysteresis::source(const Fixed& c) {
  return {fmt::format("FixedHysteresis<{}>", c.plays.count),
          fmt::format("{{{{{}, {}}}, {}}}", c.plays.count, braces(c.plays.radius, c.plays.count),
                      braces(c.weight, c.plays.count))};
}

}  // namespace flexor::model
