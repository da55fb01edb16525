// {"type": "pole_pair", "frequency_rad_s", "damping", "taps" ([0, 0])}: complex poles, 0 < damping < 1.
#pragma once

#include <array>

#include "host/model/kind.hpp"
#include "runtime/compensator/pole_pair.hpp"

namespace flexor::model {

struct PolePair {
  static constexpr bool kKeepsFraction = false;
  using Fixed = compensator::FixedPolePair;
  template <class Real>
  using Floating = compensator::PolePair<Real>;

  double frequency_rad_s = 1;
  double damping = 0.7;
  std::vector<double> taps = {0, 0};

  static constexpr auto members() {
    return std::tuple(required("frequency_rad_s", &PolePair::frequency_rad_s),
                      required("damping", &PolePair::damping),
                      defaulted("taps", &PolePair::taps, Bounds{2, 2}));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double period_s) const {
    const std::array<double, 4> t = transition(period_s);
    return {
        {static_cast<Real>(t[0]), static_cast<Real>(t[1]), static_cast<Real>(t[2]), static_cast<Real>(t[3])},
        {static_cast<Real>(taps[0]), static_cast<Real>(taps[1])}};
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const PolePair&) const = default;

 private:
  std::array<double, 4> transition(double period_s) const;  // row by row
  struct Reach {
    double state = 0;
    double output = 0;
  };
  Reach reach(double period_s) const;  // for an input of width 1 either way
};

}  // namespace flexor::model
