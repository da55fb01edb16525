// {"type": "polynomial", "low", "high", "coefficients"}: in t = (2 u - low - high) / (high - low), which
//   runs from -1 to 1; 1 to kMaxCoefficients of them.
// {"type": "spline", "x", "y"}: natural cubic spline through 2 to kMaxKnots knots.
// Both are held at their ends. In fixed point each is a piecewise-linear curve no further from it than
// kSmoothError of its range.
#pragma once

#include <functional>
#include <vector>

#include "host/model/curve.hpp"
#include "runtime/compensator/smooth.hpp"

namespace flexor::model {

inline constexpr int kMaxCoefficients = 10;
inline constexpr double kSmoothError = 1e-3;

struct Polynomial {
  static constexpr const char* kType = "polynomial";
  static constexpr bool kKeepsFraction = false;
  using Fixed = Curve::Fixed;
  template <class Real>
  using Floating = compensator::Polynomial<Real, kMaxCoefficients>;

  double low = 0;
  double high = 0;
  std::vector<double> coefficients;

  static Polynomial read(io::JsonReader& block);
  void write(Json& json) const;
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    Floating<Real> c{
        static_cast<std::uint8_t>(coefficients.size()), static_cast<Real>(low), static_cast<Real>(high), {}};
    for (std::size_t i = 0; i < coefficients.size(); ++i)
      c.coefficient[i] = static_cast<Real>(coefficients[i]);
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  int most_fraction(const FixedSignal& in) const;
  static Source source(const Fixed& c) { return Curve::source(c); }
  std::string text() const;
  bool operator==(const Polynomial&) const = default;
};

struct Spline {
  static constexpr const char* kType = "spline";
  static constexpr bool kKeepsFraction = false;
  using Fixed = Curve::Fixed;
  template <class Real>
  using Floating = compensator::Cubic<Real, kMaxKnots>;

  std::vector<double> x;
  std::vector<double> y;

  static Spline read(io::JsonReader& block);
  void write(Json& json) const;
  void check(const Place& place) const;
  Interval values(std::span<const Interval> in, double period_s) const;
  Need need(const FixedSignal& in, const Need& out) const;
  template <class Real>
  Floating<Real> floating(double) const {
    const std::vector<double> bend = second_derivatives();
    Floating<Real> c{};
    c.count = static_cast<std::uint8_t>(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      c.x[i] = static_cast<Real>(x[i]);
      c.a[i] = static_cast<Real>(y[i]);
      if (i + 1 == x.size()) break;
      const double h = x[i + 1] - x[i];
      c.r[i] = static_cast<Real>(1 / h);
      c.b[i] = static_cast<Real>(y[i + 1] - y[i] - h * h * (2 * bend[i] + bend[i + 1]) / 6);
      c.c[i] = static_cast<Real>(h * h * bend[i] / 2);
      c.d[i] = static_cast<Real>(h * h * (bend[i + 1] - bend[i]) / 6);
    }
    return c;
  }
  Fixed fixed(const FixedBlock& block) const;
  int most_fraction(const FixedSignal& in) const;
  static Source source(const Fixed& c) { return Curve::source(c); }
  std::string text() const;
  bool operator==(const Spline&) const = default;

 private:
  std::vector<double> second_derivatives() const;  // at the knots; zero at both ends
};

// A piecewise-linear curve through points of f: its worst piece is halved until all come within `error`, or it has
// kMaxKnots points.
Curve piecewise(const std::function<double(double)>& f, double low, double high, double error);

}  // namespace flexor::model
