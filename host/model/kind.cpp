#include "host/model/kind.hpp"

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"

namespace flexor::model {

void Place::require(bool good, const std::string& rule) const {
  if (!good) throw io::InputError(fmt::format("{}: {}", where, rule));
}

void Place::readings(std::span<const double> values) const {
  const bool good = std::ranges::all_of(values, [](double v) { return std::abs(v) <= kMaxSignal; });
  require(good, fmt::format("every number must be finite, at most {:g} either way", kMaxSignal));
}

}  // namespace flexor::model
