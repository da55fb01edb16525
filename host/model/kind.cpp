#include "host/model/kind.hpp"

#include "host/io/io.hpp"

namespace flexor::model {

void Place::require(bool good, const std::string& rule) const {
  if (!good) throw io::InputError("{}: {}", where, rule);
}

void Place::readings(std::span<const double> values) const {
  const bool good = std::ranges::all_of(values, [](double v) { return std::abs(v) <= kMaxSignal; });
  require(good, fmt::format("every number must be finite, at most {:g} either way", kMaxSignal));
}

void Place::rate(double rate_rad_s, const char* name) const {
  const double speed = rate_rad_s * period_s;
  require(speed >= kMinPoleTimesPeriod && speed <= kMaxPoleTimesPeriod,
          fmt::format("{} ({:.6g} rad/s) must lie between {:.3g} and {:.3g} at this sample period", name,
                      rate_rad_s, kMinPoleTimesPeriod / period_s, kMaxPoleTimesPeriod / period_s));
}

bool fits(double value, int fraction) { return std::abs(std::round(std::ldexp(value, fraction))) <= 32767; }

void FixedFormat::does_not_fit(const std::string& what) const {
  throw io::InputError("{}: {} does not fit the fixed-point format", where, what);
}

std::int16_t FixedFormat::number(const char* what, double value, int fraction) const {
  if (!fits(value, fraction)) does_not_fit(fmt::format("{} ({:.6g})", what, value));
  return static_cast<std::int16_t>(std::round(std::ldexp(value, fraction)));
}

int FixedFormat::fraction(const char* what, double magnitude, int low, int high) const {
  for (int fraction = high; fraction >= low; --fraction) {
    if (fits(magnitude, fraction)) return fraction;
  }
  does_not_fit(fmt::format("{} ({:.6g})", what, magnitude));
}

core::Weight weight(double value) {
  constexpr int kMaxShift = 15;
  int shift = 0;
  while (shift < kMaxShift && std::round(std::ldexp(value, 17 + shift)) <= 65535) ++shift;
  const double mantissa = std::clamp(std::round(std::ldexp(value, 16 + shift)), 0.0, 65535.0);
  return {static_cast<std::uint16_t>(mantissa), static_cast<std::uint8_t>(shift)};
}

}  // namespace flexor::model
