#include "host/twin/glove.hpp"

#include <algorithm>

namespace flexor::twin {

Divider::Divider(const Parameters& p)
    : flat_kohm_(p.flat_kohm), kohm_per_deg_(p.kohm_per_deg), fixed_kohm_(p.divider_kohm) {
  for (int n = 0; n <= kAdcTop; ++n) {
    const double kohm = n == kAdcTop ? 1e9 : fixed_kohm_ * n / (kAdcTop - n);
    alpha_deg_[static_cast<std::size_t>(n)] =
        std::clamp((kohm - flat_kohm_) / kohm_per_deg_, -kAlphaTop_deg, kAlphaTop_deg);
  }
}

}  // namespace flexor::twin
