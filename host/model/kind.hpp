// What every kind of block has in common, and the ranges of the signals between blocks. Each kind is a struct (kinds.hpp,
// lti.hpp) in the list of runtime/compensator/blocks.hpp, with
//
//   static constexpr bool kKeepsFraction           fixed point: its output has the fraction of its input
//   static constexpr auto members()                in a document, beside "type", "from", "to" (members.hpp)
//   void check(const Place&) const                 throws io::InputError naming the rule and the mend
//   Interval values(inputs, period_s) const        every value that its output can take
//   Need need(inputs, output) const                of its first input, in fixed point
//   Floating<Real> floating<Real>(period_s) const  runtime coefficients, in double or float
//   Fixed fixed(const FixedBlock&) const           the same in integers; throws when a number does not fit
//   bool operator==
//
// The equations are those of the runtime's headers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/model/members.hpp"
#include "runtime/core/weight.hpp"

namespace flexor::model {

// Numbers that no glove, hand or sensor has are refused, so that every accepted model gives finite angles in
// double and float.
inline constexpr double kMaxAngle_deg = 1000;
inline constexpr double kMaxSignal = 1e9;  // readings and all signals between blocks, in any unit
inline constexpr double kMinRange = 1e-20;
inline constexpr double kMinRelativeRange = 1e-6;  // of the largest number in it
inline constexpr double kMinPoleTimesPeriod = 1e-9;
inline constexpr double kMaxPoleTimesPeriod = 1e3;
inline constexpr double kMaxTap = 1000;

// The block that is checked.
struct Place {
  std::string where;  // "index: curve"
  double period_s = 0;

  // Throws io::InputError, "where: rule", unless good.
  void require(bool good, const std::string& rule) const;
  // Finite, at most kMaxSignal either way.
  void readings(std::span<const double> values) const;
  // Above 0, and neither too slow nor too quick for the sample period.
  void rate(double rate_rad_s, const char* name) const;
};

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

// One block of a model in fixed point.
struct FixedBlock : FixedFormat {
  double period_s = 0;
  std::vector<FixedSignal> in;
  FixedSignal out;
};

}  // namespace flexor::model
