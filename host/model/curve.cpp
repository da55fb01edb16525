#include "host/model/curve.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {
namespace {

constexpr double kMinKnotSpacing = 1e-6;  // of the largest |x|
constexpr double kMostRise = 16383;       // between two knots, in the output's steps

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

int Curve::most_fraction(const FixedSignal&) const {
  const double height = Interval{std::ranges::min(y), std::ranges::max(y)}.magnitude();
  double rise = 0;
  for (std::size_t i = 1; i < y.size(); ++i) rise = std::max(rise, std::abs(y[i] - y[i - 1]));
  int most = kMostFraction;
  while (most > -kMostFraction && (std::ldexp(rise, most) > kMostRise || std::ldexp(height, most) > 32767))
    --most;
  return most;
}

Curve::Fixed Curve::fixed(const FixedBlock& block) const {
  const int from = block.in[0].fraction;
  const int to = block.out.fraction;
  // A knot between two steps of the input moves to the nearer, along the curve: only its corner is cut.
  std::vector<std::int16_t> at;
  for (const double knot : x) {
    const double limit = std::ldexp(32767.0, -from);
    const std::int16_t step = block.number("a knot", std::clamp(knot, -limit, limit), from);
    if (at.empty() || step > at.back()) at.push_back(step);
  }
  if (at.size() < 2) block.does_not_fit("the range of its knots");
  Fixed c{};
  c.knots.count = static_cast<std::uint8_t>(at.size());
  const Floating<double> f = floating<double>(0);
  for (std::size_t i = 0; i < at.size(); ++i) {
    c.knots.x[i] = at[i];
    c.knots.scale[i] = 1;
    c.values.at[i].y = block.number("its value", f(std::ldexp(at[i], -from)), to);
  }
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const auto width = static_cast<std::uint16_t>(at[i + 1] - at[i]);
    c.knots.scale[i] = compensator::scale_of(width);
    c.values.at[i].slope =
        compensator::slope_of(static_cast<std::int16_t>(c.values.at[i + 1].y - c.values.at[i].y),
                              static_cast<std::uint16_t>(width * c.knots.scale[i]));
  }
  return c;
}

std::string Curve::knots_text(const Fixed& c) {
  return fmt::format("{{{}, {}, {}}}", c.knots.count, braces(c.knots.x, c.knots.count),
                     braces(c.knots.scale, c.knots.count));
}

Source Curve::source(const Fixed& c) {
  std::string values;
  for (std::size_t i = 0; i < c.knots.count; ++i) {
    values += fmt::format("{}{{{}, {}}}", i > 0 ? ", " : "", c.values.at[i].y, c.values.at[i].slope);
  }
  return {fmt::format("FixedValues<{}>", c.knots.count), fmt::format("{{{{{}}}}}", values)};
}

}  // namespace flexor::model
