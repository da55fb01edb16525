// {"type": "curve", "x", "y"}: piecewise linear through 2 to kMaxKnots knots, x strictly increasing, held at
// its ends. Neighbouring knots are at least a millionth of the largest |x| apart.
#pragma once

#include <vector>

#include "host/model/kind.hpp"
#include "runtime/compensator/curve.hpp"

namespace flexor::model {

inline constexpr int kMaxKnots = 32;

struct Curve {
  static constexpr bool kKeepsFraction = false;
  using Fixed = compensator::FixedCurve<kMaxKnots>;
  template <class Real>
  using Floating = compensator::Curve<Real, kMaxKnots>;

  std::vector<double> x;
  std::vector<double> y;

  double operator()(double u) const;

  static constexpr auto members() {
    return std::tuple(required("x", &Curve::x, Bounds{2, kMaxKnots}),
                      required("y", &Curve::y, Bounds{2, kMaxKnots}));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  // No more fraction bits of the output than its slopes allow.
  int most_fraction(const FixedSignal& in) const;
  template <class Real>
  Floating<Real> floating(double) const {
    Floating<Real> c{};
    c.count = static_cast<std::uint8_t>(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      c.x[i] = static_cast<Real>(x[i]);
      c.y[i] = static_cast<Real>(y[i]);
      if (i + 1 < x.size()) c.slope[i] = static_cast<Real>((y[i + 1] - y[i]) / (x[i + 1] - x[i]));
    }
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  // Values and slopes; the knots apart, since several curves may share them.
  static Source source(const Fixed& c);
  static std::string knots_text(const Fixed& c);
  bool operator==(const Curve&) const = default;
};

void check_knots(const Place& place, const std::vector<double>& x, const std::vector<double>& y);

}  // namespace flexor::model
