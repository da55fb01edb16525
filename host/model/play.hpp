// {"type": "play", "radius"}: in the input's unit.
#pragma once

#include "host/model/kind.hpp"
#include "runtime/compensator/play.hpp"

namespace flexor::model {

struct Play {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::Play<std::int16_t>;
  template <class Real>
  using Floating = compensator::Play<Real>;

  double radius = 0;

  static constexpr auto members() { return std::tuple(required("radius", &Play::radius)); }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<Real>(radius)};
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const Play&) const = default;
};

}  // namespace flexor::model
