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
      reference_V_(p.reference_V) {
  for (int n = 0; n <= kAdcTop; ++n) {
    alpha_deg_[static_cast<std::size_t>(n)] =
        std::clamp((kohm(n) - flat_kohm_) / kohm_per_deg_, -kAlphaTop_deg, kAlphaTop_deg);
  }
}

double Divider::kohm(int n) const { return n == kAdcTop ? 1e9 : fixed_kohm_ * n / (kAdcTop - n); }

std::array<double, kAdcTop + 1> Divider::readings(const std::string& unit, const std::string& input) const {
  std::array<double, kAdcTop + 1> out{};
  for (int n = 0; n <= kAdcTop; ++n) {
    double& reading = out[static_cast<std::size_t>(n)];
    if (unit == "deg")
      reading = alpha_deg(n);
    else if (unit == "rad")
      reading = alpha_deg(n) * std::numbers::pi / 180;
    else if (unit == "count")
      reading = n;
    else if (unit == "V")
      reading = reference_V_ * n / kAdcTop;
    else if (unit == "mV")
      reading = 1000 * reference_V_ * n / kAdcTop;
    else if (unit == "kohm")
      reading = kohm(n);
    else if (unit == "ohm")
      reading = 1000 * kohm(n);
    else
      throw io::InputError(fmt::format(
          "input {:?}: {}; the twin's glove reads count, V, mV, ohm, kohm, deg or rad: write it as its "
          "\"unit\"",
          input, unit.empty() ? "the model does not say its unit" : fmt::format("its unit is {:?}", unit)));
  }
  return out;
}

}  // namespace flexor::twin
