#include "host/twin/glove.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "host/io/io.hpp"

namespace flexor::twin {

Divider::Divider(const Parameters& p)
    : flat_kohm_(p.flat_kohm),
      kohm_per_deg_(p.kohm_per_deg),
      fixed_kohm_(p.divider_kohm),
      reference_V_(p.reference_V) {}

double Divider::kohm(double counts) const {
  return counts >= kAdcTop ? 1e9 : fixed_kohm_ * counts / (kAdcTop - counts);
}

double Divider::alpha_deg(double counts) const {
  return std::clamp((kohm(counts) - flat_kohm_) / kohm_per_deg_, -kAlphaTop_deg, kAlphaTop_deg);
}

std::function<double(double)> Divider::reading(const std::string& unit, const std::string& input) const {
  if (unit == "deg") return [*this](double n) { return alpha_deg(n); };
  if (unit == "rad") return [*this](double n) { return alpha_deg(n) * std::numbers::pi / 180; };
  if (unit == "count") return [](double n) { return n; };
  if (unit == "V") return [*this](double n) { return reference_V_ * n / kAdcTop; };
  if (unit == "mV") return [*this](double n) { return 1000 * reference_V_ * n / kAdcTop; };
  if (unit == "kohm") return [*this](double n) { return kohm(n); };
  if (unit == "ohm") return [*this](double n) { return 1000 * kohm(n); };
  throw io::InputError(
      "input {:?}: {}; the twin's glove reads count, V, mV, ohm, kohm, deg or rad: write it as its \"unit\"",
      input, unit.empty() ? "the model does not state its unit" : fmt::format("its unit is {:?}", unit));
}

}  // namespace flexor::twin
