#include "host/model/smooth.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace flexor::model {
namespace {

constexpr int kLooks = 16;  // between two knots
constexpr double kSmoothAim = kSmoothError / 10;

// Extremes of f, as finely as a curve of all its knots would be looked at.
Interval seen(const std::function<double(double)>& f, double low, double high) {
  constexpr int kPoints = kMaxKnots * kLooks;
  Interval out{f(low), f(low)};
  for (int i = 1; i <= kPoints; ++i) {
    const double y = f(low + (high - low) * i / kPoints);
    out = hull(out, {y, y});
  }
  // Between two points it may go a little further.
  const double margin = 0.01 * out.width();
  return {out.min - margin, out.max + margin};
}

// Of the straight piece behind knot i.
double piece_error(const Curve& curve, std::size_t i, const std::function<double(double)>& f) {
  double worst = 0;
  for (int k = 1; k < kLooks; ++k) {
    const double share = static_cast<double>(k) / kLooks;
    const double u = curve.x[i] + share * (curve.x[i + 1] - curve.x[i]);
    worst = std::max(worst, std::abs(curve.y[i] + share * (curve.y[i + 1] - curve.y[i]) - f(u)));
  }
  return worst;
}

double error_of(const Curve& curve, const std::function<double(double)>& f) {
  double worst = 0;
  for (std::size_t i = 0; i + 1 < curve.x.size(); ++i) worst = std::max(worst, piece_error(curve, i, f));
  return worst;
}

Curve smooth_curve(const std::function<double(double)>& f, double low, double high) {
  return piecewise(f, low, high, kSmoothAim * seen(f, low, high).width());
}

Curve::Fixed fixed_curve(const FixedBlock& block, const std::function<double(double)>& f, double low,
                         double high) {
  const Curve curve = smooth_curve(f, low, high);
  if (error_of(curve, f) > kSmoothError * seen(f, low, high).width()) {
    block.does_not_fit(fmt::format("so bent a shape ({} straight pieces do not follow it)", kMaxKnots - 1));
  }
  return curve.fixed(block);
}

}  // namespace

Curve piecewise(const std::function<double(double)>& f, double low, double high, double error) {
  Curve out{{low, high}, {f(low), f(high)}};
  std::vector<double> errors = {piece_error(out, 0, f)};
  while (out.x.size() < kMaxKnots) {
    const auto worst = std::ranges::max_element(errors);
    if (*worst <= error) break;
    const auto i = worst - errors.begin();
    const auto at = static_cast<std::size_t>(i);
    const double middle = out.x[at] + (out.x[at + 1] - out.x[at]) / 2;
    out.x.insert(out.x.begin() + i + 1, middle);
    out.y.insert(out.y.begin() + i + 1, f(middle));
    errors[at] = piece_error(out, at, f);
    errors.insert(errors.begin() + i + 1, piece_error(out, at + 1, f));
  }
  return out;
}

Polynomial Polynomial::read(io::JsonReader& block) {
  return {block.number("low"), block.number("high"), block.numbers("coefficients")};
}

void Polynomial::write(Json& json) const {
  json["low"] = low;
  json["high"] = high;
  json["coefficients"] = coefficients;
}

void Polynomial::check(const Place& place) const {
  place.readings({{low, high}});
  place.readings(coefficients);
  const double least = std::max(kMinRange, kMinRelativeRange * std::max(std::abs(low), std::abs(high)));
  place.require(high - low >= least, fmt::format("low must be below high, by {:.3g} at least", least));
  place.require(!coefficients.empty() && coefficients.size() <= kMaxCoefficients,
                fmt::format("must have 1 to {} coefficients", kMaxCoefficients));
}

// |t| <= 1.
Interval Polynomial::values(std::span<const Interval>, double) const {
  double reach = 0;
  for (std::size_t i = 1; i < coefficients.size(); ++i) reach += std::abs(coefficients[i]);
  return {coefficients[0] - reach, coefficients[0] + reach};
}

Need Polynomial::need(const FixedSignal&, const Need&) const { return {{low, high}, kMostFraction, true}; }

int Polynomial::most_fraction(const FixedSignal& in) const {
  return smooth_curve(floating<double>(0), low, high).most_fraction(in);
}

Polynomial::Fixed Polynomial::fixed(const FixedBlock& block) const {
  return fixed_curve(block, floating<double>(0), low, high);
}

std::string Polynomial::text() const {
  return fmt::format("{::.4g} in t, -1 at {:.4g} and 1 at {:.4g}", coefficients, low, high);
}

Spline Spline::read(io::JsonReader& block) { return {block.numbers("x"), block.numbers("y")}; }

void Spline::write(Json& json) const {
  json["x"] = x;
  json["y"] = y;
}

void Spline::check(const Place& place) const { check_knots(place, x, y); }

// h_{i-1} m_{i-1} + 2 (h_{i-1} + h_i) m_i + h_i m_{i+1} = 6 (slope_i - slope_{i-1}), m = 0 at the ends.
std::vector<double> Spline::second_derivatives() const {
  const auto n = static_cast<Eigen::Index>(x.size());
  std::vector<double> out(x.size(), 0.0);
  if (n < 3) return out;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n - 2, n - 2);
  Eigen::VectorXd b(n - 2);
  for (Eigen::Index i = 0; i < n - 2; ++i) {
    const auto k = static_cast<std::size_t>(i) + 1;
    const double left = x[k] - x[k - 1];
    const double right = x[k + 1] - x[k];
    a(i, i) = 2 * (left + right);
    if (i > 0) a(i, i - 1) = left;
    if (i + 1 < n - 2) a(i, i + 1) = right;
    b(i) = 6 * ((y[k + 1] - y[k]) / right - (y[k] - y[k - 1]) / left);
  }
  const Eigen::VectorXd m = a.partialPivLu().solve(b);
  std::copy(m.begin(), m.end(), out.begin() + 1);
  return out;
}

Interval Spline::values(std::span<const Interval>, double) const {
  return seen(floating<double>(0), x.front(), x.back());
}

Need Spline::need(const FixedSignal&, const Need&) const {
  return {{x.front(), x.back()}, kMostFraction, true};
}

int Spline::most_fraction(const FixedSignal& in) const {
  return smooth_curve(floating<double>(0), x.front(), x.back()).most_fraction(in);
}

Spline::Fixed Spline::fixed(const FixedBlock& block) const {
  return fixed_curve(block, floating<double>(0), x.front(), x.back());
}

std::string Spline::text() const { return Curve{x, y}.text(); }

}  // namespace flexor::model
