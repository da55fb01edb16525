#include "host/score/least_squares.hpp"

#include <Eigen/QR>
#include <algorithm>

#include "host/io/numbers.hpp"

namespace flexor::score {
namespace {

constexpr std::ptrdiff_t kKnots = 24;
constexpr double kSmooth = 0.5;
constexpr double kAnchor = 1e-3;

// Quantiles, each once.
std::vector<double> knots_of(std::vector<double> x) {
  std::ranges::sort(x);
  std::vector<double> out;
  for (std::ptrdiff_t k = 0; k < kKnots; ++k)
    out.push_back(x[static_cast<std::size_t>(k * (std::ssize(x) - 1) / (kKnots - 1))]);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

std::vector<double> least_squares_curve(const std::vector<double>& x, const std::vector<double>& y,
                                        const std::vector<double>& at) {
  const std::vector<double> knots = knots_of(x);
  const std::ptrdiff_t n = std::ssize(knots);
  if (n < 2) return std::vector<double>(at.size(), y.front());
  Eigen::MatrixXd gram = kAnchor * Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto [k, on] = io::place(knots, x[i]);
    const Eigen::Vector2d hat(1 - on, on);
    gram.block<2, 2>(k, k) += hat * hat.transpose();
    right.segment<2>(k) += hat * y[i];
  }
  const Eigen::RowVector3d bend(1, -2, 1);
  for (std::ptrdiff_t k = 0; k + 2 < n; ++k) gram.block<3, 3>(k, k) += kSmooth * bend.transpose() * bend;
  const Eigen::VectorXd value = gram.colPivHouseholderQr().solve(right);
  std::vector<double> out;
  for (const double u : at) {
    const auto [k, on] = io::place(knots, u);
    out.push_back((1 - on) * value(k) + on * value(k + 1));
  }
  return out;
}

}  // namespace flexor::score
