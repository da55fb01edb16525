// The kinds of block that a document may have, apart from lti.hpp's: the equations are those of the runtime's headers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/model/kind.hpp"
#include "runtime/compensator/blocks.hpp"

namespace flexor::model {

inline constexpr int kMaxTerms = 32;
inline constexpr int kMaxKnots = 32;
inline constexpr int kMaxPlays = 4;

// {"type": "sum", "weights", "offset" (0)}: weighted sum of its inputs, one weight for each.
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
  void check(const Place& place) const {
    place.readings(weights);
    place.readings({{offset}});
  }
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    Floating<Real> c{static_cast<std::uint8_t>(weights.size()), {}, static_cast<Real>(offset)};
    for (std::size_t i = 0; i < weights.size(); ++i) c.weight[i] = static_cast<Real>(weights[i]);
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  bool operator==(const Sum&) const = default;
};

// {"type": "gain", "gain", "offset" (0)}: gain u + offset.
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
  bool operator==(const Gain&) const = default;

 private:
  Sum as_sum() const { return {{gain}, offset}; }
};

// {"type": "dead_zone", "lower", "upper"}: edges in the input's unit, lower <= upper.
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
  void check(const Place& place) const {
    place.readings({{lower, upper}});
    place.require(lower <= upper, "lower must not exceed upper");
  }
  Interval values(std::span<const Interval> in, double) const {
    const Floating<double> zone{lower, upper};
    return {zone(in[0].min), zone(in[0].max)};
  }
  // The same step serves input and output: both must fit.
  Need need(const FixedSignal& in, const Need& out) const {
    return {hull(in.values, values({{in.values}}, 0)), kMostFraction, out.finer};
  }
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<Real>(lower), static_cast<Real>(upper)};
  }
  Fixed fixed(const FixedBlock& block) const {
    const int fraction = block.in[0].fraction;
    (void)block.number("its signal", values({{block.in[0].values}}, 0).magnitude(), fraction);
    // An edge beyond all int16 is never passed, unless the zone lies there altogether.
    const double most = std::ldexp(32767, -fraction);
    return {block.number("lower", upper < -most ? lower : std::max(lower, -most), fraction),
            block.number("upper", lower > most ? upper : std::min(upper, most), fraction)};
  }
  bool operator==(const DeadZone&) const = default;
};

// {"type": "saturation", "lower_deg", "upper_deg"}: lower < upper. Each joint's last block.
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
  void check(const Place& place) const {
    place.require(std::abs(lower_deg) <= kMaxAngle_deg && std::abs(upper_deg) <= kMaxAngle_deg,
                  fmt::format("must lie within {:g} degrees either way", kMaxAngle_deg));
    place.require(lower_deg < upper_deg, "lower_deg must be below upper_deg");
  }
  Interval values(std::span<const Interval> in, double) const {
    return {std::clamp(in[0].min, lower_deg, upper_deg), std::clamp(in[0].max, lower_deg, upper_deg)};
  }
  // Beyond the limits one step is as good as any.
  Need need(const FixedSignal&, const Need& out) const {
    return {{lower_deg, upper_deg}, out.fraction, out.finer};
  }
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<Real>(lower_deg), static_cast<Real>(upper_deg)};
  }
  Fixed fixed(const FixedBlock& block) const {
    const int fraction = block.in[0].fraction;
    // A limit that no int16 reaches limits nothing.
    const double most = std::ldexp(32767, -fraction);
    return {block.number("lower_deg", std::clamp(lower_deg, -most, most), fraction),
            block.number("upper_deg", std::clamp(upper_deg, -most, most), fraction)};
  }
  bool operator==(const Saturation&) const = default;
};

// {"type": "curve", "x", "y"}: piecewise linear through 2 to kMaxKnots knots, x strictly increasing, held at
// its ends. Neighbouring knots are at least a millionth of the largest |x| apart.
struct Curve {
  static constexpr bool kKeepsFraction = false;
  using Fixed = compensator::FixedCurve<kMaxKnots>;
  template <class Real>
  using Floating = compensator::Curve<Real, kMaxKnots>;

  std::vector<double> x;
  std::vector<double> y;

  double operator()(double u) const { return floating<double>(0)(u); }

  static constexpr auto members() {
    return std::tuple(required("x", &Curve::x, Bounds{2, kMaxKnots}),
                      required("y", &Curve::y, Bounds{2, kMaxKnots}));
  }
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal&, const Need&) const { return {{x.front(), x.back()}, kMostFraction, true}; }
  // No more fraction bits of the output than its slopes allow.
  int most_fraction() const;
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
  bool operator==(const Curve&) const = default;
};

// {"type": "play", "radius"}: radius >= 0 in the input's unit.
struct Play {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::Play<std::int16_t>;
  template <class Real>
  using Floating = compensator::Play<Real>;

  double radius = 0;

  static constexpr auto members() { return std::tuple(required("radius", &Play::radius)); }
  void check(const Place& place) const {
    place.readings({{radius}});
    place.require(radius >= 0, "the radius must not be negative");
  }
  Interval values(std::span<const Interval> in, double) const { return in[0]; }
  // Where saturating changes nothing: what the play still remembers lies up to a diameter beyond what is needed
  // of its output.
  Need need(const FixedSignal&, const Need& out) const {
    const double margin = 2 * radius + 1;
    return {{out.values.min - margin, out.values.max + margin}, kMostFraction, true};
  }
  template <class Real>
  Floating<Real> floating(double) const {
    return {static_cast<Real>(radius)};
  }
  // A radius that the input never reaches is as good as any larger one.
  Fixed fixed(const FixedBlock& block) const {
    return {block.number("radius", std::min(radius, block.in[0].values.width()), block.in[0].fraction)};
  }
  bool operator==(const Play&) const = default;
};

// {"type": "hysteresis", "radii", "weights"}: a bank of plays, Prandtl-Ishlinskii; radii >= 0 in the input's
// unit, |w| < 8, 1 to kMaxPlays of them.
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
  Interval values(std::span<const Interval> in, double) const {
    return {in[0].min - reach(), in[0].max + reach()};
  }
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
  bool operator==(const Hysteresis&) const = default;

 private:
  double reach() const;  // |output - input| at most
};

// {"type": "lag", "rate_rad_s"}: first-order lag of unit gain, pole -rate; rate times the sample period from 1e-9 to
// 1e3.
struct Lag {
  static constexpr bool kKeepsFraction = true;
  using Fixed = compensator::FixedLag;
  template <class Real>
  using Floating = compensator::Lag<Real>;

  double rate_rad_s = 1;

  static constexpr auto members() { return std::tuple(required("rate_rad_s", &Lag::rate_rad_s)); }
  void check(const Place& place) const { place.rate(rate_rad_s, "rate_rad_s"); }
  Interval values(std::span<const Interval> in, double) const { return in[0]; }
  // What is far beyond the need still pulls: nothing of the input may saturate.
  Need need(const FixedSignal& in, const Need& out) const { return {in.values, out.fraction, out.finer}; }
  double share(double period_s) const { return -std::expm1(-rate_rad_s * period_s); }
  template <class Real>
  Floating<Real> floating(double period_s) const {
    return {static_cast<Real>(share(period_s))};
  }
  Fixed fixed(const FixedBlock& block) const { return {weight(share(block.period_s))}; }
  bool operator==(const Lag&) const = default;
};

// {"type": "pole_pair", "frequency_rad_s", "damping", "taps" ([0, 0])}: complex poles, 0 < damping < 1.
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
  Need need(const FixedSignal& in, const Need&) const { return {in.values, kMostFraction, false}; }
  template <class Real>
  Floating<Real> floating(double period_s) const {
    Floating<Real> c{{}, {static_cast<Real>(taps[0]), static_cast<Real>(taps[1])}};
    std::ranges::transform(transition(period_s), c.transition, [](double t) { return static_cast<Real>(t); });
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
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
