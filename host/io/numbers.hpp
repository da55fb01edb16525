// What several rooms ask of rows of numbers.
#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace flexor::io {

// On the straight lines between the points (x, y), x never decreasing; the nearest point outside.
inline double interpolate(std::span<const double> x, std::span<const double> y, double at) {
  const auto n = static_cast<std::size_t>(std::ranges::lower_bound(x, at) - x.begin());
  if (n == 0) return y.front();
  if (n == x.size()) return y.back();
  return y[n - 1] + (at - x[n - 1]) / (x[n] - x[n - 1]) * (y[n] - y[n - 1]);
}

// The knot below, of two or more that increase, and how far on to the next one: 0 to 1.
inline std::pair<std::ptrdiff_t, double> place(std::span<const double> knots, double at) {
  const auto next = std::ranges::upper_bound(knots, at) - knots.begin();
  const auto below = knots.begin() + std::clamp<std::ptrdiff_t>(next - 1, 0, std::ssize(knots) - 2);
  return {below - knots.begin(), std::clamp((at - below[0]) / (below[1] - below[0]), 0.0, 1.0)};
}

// Of an even count the upper one; of one value at least.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace flexor::io
