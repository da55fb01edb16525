// What an outlier does not move; for this room only.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/io/numbers.hpp"

namespace flexor::identify {

using io::median;

inline constexpr double kLoss_deg = 1;  // a camera's error

// sqrt(2 rho(r)), rho the pseudo-Huber loss d^2 (sqrt(1 + (r/d)^2) - 1), with the sign of r, and its slope: the robust cost is
// half the squares of these.
struct Bent {
  double value;
  double slope;
};
inline Bent bend(double r, double d) {
  const double root = std::sqrt(1 + r / d * r / d);
  const double share = std::sqrt(2 / (root + 1));
  return {share * r, 1 / (root * share)};
}

// e^2 where it is small, 2 d |e| where it is large; degrees squared.
inline double loss_of(double error_deg) {
  const double bent = bend(error_deg, kLoss_deg).value;
  return bent * bent;
}

inline double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

inline std::vector<double> sorted(const Eigen::VectorXd& values) {
  std::vector<double> out(values.begin(), values.end());
  std::ranges::sort(out);
  return out;
}

inline double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(std::lround(q * static_cast<double>(sorted.size() - 1)))];
}

// Standard deviation of a normal distribution with this median of |residual|.
inline double robust_deviation(const Eigen::VectorXd& residual) {
  std::vector<double> absolute(residual.begin(), residual.end());
  for (double& r : absolute) r = std::abs(r);
  return 1.4826 * median(std::move(absolute));
}

}  // namespace flexor::identify
