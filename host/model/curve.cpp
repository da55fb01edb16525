#include "host/model/curve.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {
namespace {

constexpr double kMinKnotSpacing = 1e-6;  // of the largest |x|

double steepest(const Curve& curve) {
  double slope = 0;
  for (std::size_t i = 1; i < curve.x.size(); ++i) {
    slope = std::max(slope, std::abs((curve.y[i] - curve.y[i - 1]) / (curve.x[i] - curve.x[i - 1])));
  }
  return slope;
}

}  // namespace

void check_knots(const Place& place, const std::vector<double>& x, const std::vector<double>& y) {
  place.readings(x);
  place.readings(y);
  place.require(x.size() == y.size(), "x and y must have as many elements");
  place.require(x.size() >= 2 && x.size() <= kMaxKnots, fmt::format("must have 2 to {} knots", kMaxKnots));
  const bool increasing = std::ranges::adjacent_find(x, std::greater_equal<>()) == x.end();
  place.require(increasing, "x must be strictly increasing");
  place.require(x.back() - x.front() >= kMinRange, fmt::format("x must range over {:g} at least", kMinRange));
  const double least = kMinKnotSpacing * std::max(std::abs(x.front()), std::abs(x.back()));
  for (std::size_t i = 1; i < x.size(); ++i) {
    place.require(
        x[i] - x[i - 1] >= least,
        fmt::format("the knots at {:.9g} and {:.9g} must be at least {:.3g} apart", x[i - 1], x[i], least));
  }
}

double Curve::operator()(double u) const { return floating<double>(0)(u); }

Curve Curve::read(io::JsonReader& block) { return {block.numbers("x"), block.numbers("y")}; }

void Curve::write(Json& json) const {
  json["x"] = x;
  json["y"] = y;
}

void Curve::check(const Place& place) const { check_knots(place, x, y); }

Interval Curve::values(std::span<const Interval> in, double) const {
  const double from = std::clamp(in[0].min, x.front(), x.back());
  const double to = std::clamp(in[0].max, x.front(), x.back());
  const Floating<double> f = floating<double>(0);
  Interval out{std::min(f(from), f(to)), std::max(f(from), f(to))};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] > from && x[i] < to) out = hull(out, {y[i], y[i]});
  }
  return out;
}

Need Curve::need(const FixedSignal&, const Need&) const {
  return {{x.front(), x.back()}, kMostFraction, true};
}

int Curve::most_fraction(const FixedSignal& in) const {
  // slope 2^(out - in + shift) fits int16 with a shift of 1 at least, and so does y of every knot.
  const double slope = steepest(*this);
  const double height = Interval{std::ranges::min(y), std::ranges::max(y)}.magnitude();
  const auto fits = [&](int out) {
    return std::ldexp(slope, out - in.fraction + 1) <= 32767 && std::ldexp(height, out) <= 32767;
  };
  int most = kMostFraction;
  while (most > -kMostFraction && !fits(most)) --most;
  return most;
}

Curve::Fixed Curve::fixed(const FixedBlock& block) const {
  const int from = block.in[0].fraction;
  const int to = block.out.fraction;
  Fixed c{};
  // A knot between two steps of the input moves to the nearer, along the curve: only its corner is cut.
  std::vector<double> at;
  for (const double knot : x) {
    const double step = std::ldexp(
        block.number("a knot",
                     std::clamp(knot, -32767 * std::ldexp(1.0, -from), 32767 * std::ldexp(1.0, -from)), from),
        -from);
    if (at.empty() || step > at.back()) at.push_back(step);
  }
  if (at.size() < 2) block.does_not_fit("the range of its knots");
  const Floating<double> f = floating<double>(0);
  double steep = 0;
  for (std::size_t i = 1; i < at.size(); ++i) {
    steep = std::max(steep, std::abs((f(at[i]) - f(at[i - 1])) / (at[i] - at[i - 1])));
  }
  const int shift = block.fraction("its slope", std::ldexp(steep, to - from), 1, 14);
  c.count = static_cast<std::uint8_t>(at.size());
  c.slope_shift = static_cast<std::uint8_t>(shift);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double slope = i + 1 < at.size() ? (f(at[i + 1]) - f(at[i])) / (at[i + 1] - at[i]) : 0;
    c.x[i] = block.number("a knot", at[i], from);
    c.y[i] = block.number("its value", f(at[i]), to);
    c.slope[i] = block.number("its slope", slope, to - from + shift);
  }
  return c;
}

Source Curve::source(const Fixed& c) {
  return {fmt::format("FixedCurve<{}>", c.count),
          fmt::format("{{{}, {}, {}, {}, {}}}", c.count, c.slope_shift, braces(c.x, c.count),
                      braces(c.y, c.count), braces(c.slope, c.count))};
}

std::string Curve::text() const {
  std::string out;
  for (std::size_t i = 0; i < x.size(); ++i) {
    out += fmt::format("{}{:.4g}: {:.4g}", i > 0 ? ", " : "", x[i], y[i]);
  }
  return out;
}

}  // namespace flexor::model
