#include "host/model/sum.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {

void Sum::check(const Place& place) const {
  place.readings(weights);
  place.readings({{offset}});
}

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

Source Sum::source(const Fixed& c) {
  return {fmt::format("FixedSum<{}>", c.count),
          fmt::format("{{{}, {}, {}, {}L}}", c.count, c.shift, braces(c.weight, c.count), c.offset)};
}

}  // namespace flexor::model
