// {"type": "play", "radius"} and {"type": "creep", "radius", "rate_rad_s"}: radius in the input's unit.
#pragma once

#include "host/model/kind.hpp"
#include "runtime/compensator/play.hpp"

namespace flexor::model {

struct Play {
  static constexpr const char* kType = "play";
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

struct Creep {
  static constexpr const char* kType = "creep";
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::FixedCreep;
  template <class Real>
  using Floating = compensator::Creep<Real>;

  double radius = 0;
  double rate_rad_s = 1;  // kMinPoleTimesPeriod / T to kMaxPoleTimesPeriod / T

  static constexpr auto members() {
    return std::tuple(required("radius", &Creep::radius), required("rate_rad_s", &Creep::rate_rad_s));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  double share(double period_s) const;
  template <class Real>
  Floating<Real> floating(double period_s) const {
    return {static_cast<Real>(radius), static_cast<Real>(share(period_s))};
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const Creep&) const = default;
};

}  // namespace flexor::model
