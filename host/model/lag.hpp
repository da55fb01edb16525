// {"type": "lag", "rate_rad_s"}: first-order lag of unit gain, pole -rate; rate times the sample period from 1e-9 to
// 1e3.
#pragma once

#include "host/model/kind.hpp"
#include "runtime/compensator/lag.hpp"

namespace flexor::model {

struct Lag {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::FixedLag;
  template <class Real>
  using Floating = compensator::Lag<Real>;

  double rate_rad_s = 1;

  static constexpr auto members() { return std::tuple(required("rate_rad_s", &Lag::rate_rad_s)); }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double) const { return in[0]; }
  Need need(const FixedSignal& in, const Need& out) const;
  double share(double period_s) const;
  template <class Real>
  Floating<Real> floating(double period_s) const {
    return {static_cast<Real>(share(period_s))};
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c) {
    return {"FixedLag", fmt::format("{{{{{}, {}}}}}", c.share.mantissa, c.share.shift)};
  }
  bool operator==(const Lag&) const = default;
};

}  // namespace flexor::model
