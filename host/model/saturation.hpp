// {"type": "saturation", "lower_deg", "upper_deg"}: lower < upper. Each joint's last block.
#pragma once

#include "host/model/kind.hpp"
#include "runtime/compensator/saturation.hpp"

namespace flexor::model {

struct Saturation {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::Saturation<std::int16_t>;
  template <class Real>
  using Floating = compensator::Saturation<Real>;

  double lower_deg = 0;
  double upper_deg = 0;

  static constexpr auto members() {
    return std::tuple(required("lower_deg", &Saturation::lower_deg),
                      required("upper_deg", &Saturation::upper_deg));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<Real>(lower_deg), static_cast<Real>(upper_deg)};
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const Saturation&) const = default;
};

}  // namespace flexor::model
