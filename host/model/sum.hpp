// {"type": "sum", "weights", "offset" (0)}: weighted sum of its inputs, one weight for each.
// {"type": "gain", "gain", "offset" (0)}: gain u + offset.
#pragma once

#include <vector>

#include "host/model/kind.hpp"
#include "runtime/compensator/sum.hpp"

namespace flexor::model {

inline constexpr int kMaxTerms = 32;

struct Sum {
  static constexpr bool kKeepsFraction = false;
  using Fixed = compensator::FixedSum<kMaxTerms>;
  template <class Real>
  using Floating = compensator::Sum<Real, kMaxTerms>;

  std::vector<double> weights;
  double offset = 0;

  static constexpr auto members() {
    return std::tuple(required("weights", &Sum::weights, Bounds{1, kMaxTerms}),
                      defaulted("offset", &Sum::offset));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    Floating<Real> c{static_cast<std::uint8_t>(weights.size()), {}, static_cast<Real>(offset)};
    for (std::size_t i = 0; i < weights.size(); ++i) c.weight[i] = static_cast<Real>(weights[i]);
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  static Source source(const Fixed& c);
  bool operator==(const Sum&) const = default;
};

struct Gain {
  static constexpr bool kKeepsFraction = false;
  using Fixed = Sum::Fixed;
  template <class Real>
  using Floating = Sum::Floating<Real>;

  double gain = 1;
  double offset = 0;

  static constexpr auto members() {
    return std::tuple(required("gain", &Gain::gain), defaulted("offset", &Gain::offset));
  }
  void check(const Place& place) const { as_sum().check(place); }
  Interval values(std::span<const Interval> in, double period_s) const {
    return as_sum().values(in, period_s);
  }
  Need need(const FixedSignal& in, const Need& out) const { return as_sum().need(in, out); }
  template <class Real>
  Floating<Real> floating(double period_s) const {
    return as_sum().floating<Real>(period_s);
  }
  Fixed fixed(const FixedBlock& block) const { return as_sum().fixed(block); }
  static Source source(const Fixed& c) { return Sum::source(c); }
  bool operator==(const Gain&) const = default;

 private:
  Sum as_sum() const { return {{gain}, offset}; }
};

}  // namespace flexor::model
