// {"type": "dead_zone", "lower", "upper"}: edges in the input's unit, lower <= upper.
#pragma once

#include "host/model/kind.hpp"
#include "runtime/compensator/dead_zone.hpp"

namespace flexor::model {

struct DeadZone {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::DeadZone<std::int16_t>;
  template <class Real>
  using Floating = compensator::DeadZone<Real>;

  double lower = 0;
  double upper = 0;

  static constexpr auto members() {
    return std::tuple(required("lower", &DeadZone::lower), required("upper", &DeadZone::upper));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<Real>(lower), static_cast<Real>(upper)};
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const DeadZone&) const = default;
};

}  // namespace flexor::model
