// {"type": "hysteresis", "radii", "weights"}: a bank of plays, Prandtl-Ishlinskii; radii >= 0 in the input's
// unit, |w| < 8, 1 to kMaxPlays of them.
#pragma once

#include <vector>

#include "host/model/kind.hpp"
#include "runtime/compensator/hysteresis.hpp"

namespace flexor::model {

inline constexpr int kMaxPlays = 4;

struct Hysteresis {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::FixedHysteresis<kMaxPlays>;
  template <class Real>
  using Floating = compensator::Hysteresis<Real, kMaxPlays>;

  std::vector<double> radii;
  std::vector<double> weights;

  static constexpr auto members() {
    return std::tuple(required("radii", &Hysteresis::radii, Bounds{1, kMaxPlays}),
                      required("weights", &Hysteresis::weights, Bounds{1, kMaxPlays}));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    Floating<Real> c{};
    c.plays.count = static_cast<std::uint8_t>(radii.size());
    for (std::size_t j = 0; j < radii.size(); ++j) {
      c.plays.radius[j] = static_cast<Real>(radii[j]);
      c.weight[j] = static_cast<Real>(weights[j]);
    }
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const Hysteresis&) const = default;

 private:
  double reach() const;  // |output - input| at most
};

}  // namespace flexor::model
