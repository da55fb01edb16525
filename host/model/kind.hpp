// What every kind of block has in common. Each kind is a struct in a file pair of its own, in the list of
// runtime/compensator/blocks.hpp, with
//
//   static constexpr bool kKeepsFraction           fixed point: its output has the fraction of its input
//   static constexpr auto members()                in a document, beside "type", "from", "to" (members.hpp)
//   void check(const Place&) const                 throws io::InputError naming the rule and the mend
//   Interval values(inputs, period_s) const        every value that its output can take
//   Need need(inputs, output) const                of its first input, in fixed point
//   Floating<Real> floating<Real>(period_s) const  runtime coefficients, in double or float
//   Fixed fixed(const FixedBlock&) const           the same in integers; throws when a number does not fit
//   static Source source(const Fixed&)             those as C++ for the firmware
//   bool operator==
//
// The equations are those of the runtime's headers.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <span>
#include <string>
#include <vector>

#include "host/model/members.hpp"
#include "host/model/signal.hpp"

namespace flexor::model {

// Numbers that no glove, hand or sensor has are refused, so that every accepted model gives finite angles in
// double and float.
inline constexpr double kMaxAngle_deg = 1000;
inline constexpr double kMaxSignal = 1e9;  // readings and all signals between blocks, in any unit
inline constexpr double kMinRange = 1e-20;
inline constexpr double kMinRelativeRange = 1e-6;  // of the largest number in it

// The block that is checked.
struct Place {
  std::string where;  // "index: curve"
  double period_s = 0;

  // Throws io::InputError, "where: rule", unless good.
  void require(bool good, const std::string& rule) const;
  // Finite, at most kMaxSignal either way.
  void readings(std::span<const double> values) const;
};

// One block of a model in fixed point.
struct FixedBlock : FixedFormat {
  double period_s = 0;
  std::vector<FixedSignal> in;
  FixedSignal out;
};

// Coefficients as C++: the type inside namespace flexor::compensator, and the braces after it.
struct Source {
  std::string type;
  std::string braces;
};

template <class Number>
std::string braces(const Number* first, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += fmt::format("{}{}", i > 0 ? ", " : "", first[i]);
  return "{" + out + "}";
}

}  // namespace flexor::model
