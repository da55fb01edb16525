// What is known of a signal between two blocks, and how fixed point holds it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "runtime/core/weight.hpp"

namespace flexor::model {

// Every value that a signal can take while the inputs lie in their valid ranges.
struct Interval {
  double min = 0;
  double max = 0;

  double magnitude() const { return std::max(std::abs(min), std::abs(max)); }
  double width() const { return max - min; }
  bool operator==(const Interval&) const = default;
};

inline Interval hull(const Interval& a, const Interval& b) {
  return {std::min(a.min, b.min), std::max(a.max, b.max)};
}

// Empty where the two do not meet: then their nearest ends.
inline Interval meet(const Interval& a, const Interval& b) {
  const double low = std::clamp(a.min, b.min, b.max);
  return {low, std::max(low, std::clamp(a.max, b.min, b.max))};
}

inline constexpr int kMostFraction = 13;

// What a block needs of its input in fixed point: values beyond `values` may saturate without changing its
// output; more fraction bits than `fraction` bring it nothing; `finer` where knots or radii lie between the
// input's own steps.
struct Need {
  Interval values;
  int fraction = 0;
  bool finer = false;
  int most = kMostFraction;  // more than so many the block cannot take
};

// A signal in fixed point: int16, round(value 2^fraction).
struct FixedSignal {
  Interval values;
  int fraction = 0;
};

// `where` is the block in messages, as "index: curve". Each throws io::InputError when a number does not fit.
struct FixedFormat {
  std::string where;

  [[noreturn]] void does_not_fit(const std::string& what) const;

  // round(value 2^fraction) as int16.
  std::int16_t number(const char* what, double value, int fraction) const;

  // Largest fraction in [low, high] for which |magnitude| 2^fraction fits int16.
  int fraction(const char* what, double magnitude, int low, int high) const;
};

// Whether round(value 2^fraction) fits int16.
bool fits(double value, int fraction);

// The weight nearest to value in [0, 1].
core::Weight weight(double value);

}  // namespace flexor::model
