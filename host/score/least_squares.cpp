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

std::vector<double> least_squares_curves(const std::vector<std::vector<double>>& x,
                                         const std::vector<double>& y,
                                         const std::vector<std::vector<double>>& at) {
  std::vector<std::vector<double>> knots;
  std::vector<std::ptrdiff_t> first = {0};  // of each curve's values
  for (const std::vector<double>& one : x) {
    knots.push_back(knots_of(one));
    if (knots.back().size() < 2) knots.back() = {one.front() - 1, one.front() + 1};
    first.push_back(first.back() + std::ssize(knots.back()));
  }
  // Where sample i lies on the curve of x number s: the first of two values, and their shares.
  const auto hat = [&](const std::vector<std::vector<double>>& samples, std::size_t s, std::size_t i) {
    const auto [k, on] = io::place(knots[s], samples[s][i]);
    return std::pair(first[s] + k, Eigen::Vector2d(1 - on, on));
  };
  Eigen::MatrixXd gram = kAnchor * Eigen::MatrixXd::Identity(first.back(), first.back());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(first.back());
  for (std::size_t i = 0; i < y.size(); ++i) {
    for (std::size_t a = 0; a < x.size(); ++a) {
      const auto [row, own] = hat(x, a, i);
      right.segment<2>(row) += own * y[i];
      for (std::size_t b = 0; b < x.size(); ++b) {
        const auto [column, other] = hat(x, b, i);
        gram.block<2, 2>(row, column) += own * other.transpose();
      }
    }
  }
  const Eigen::RowVector3d bend(1, -2, 1);
  for (std::size_t s = 0; s < knots.size(); ++s) {
    for (std::ptrdiff_t k = first[s]; k + 2 < first[s + 1]; ++k)
      gram.block<3, 3>(k, k) += kSmooth * bend.transpose() * bend;
  }
  const Eigen::VectorXd value = gram.colPivHouseholderQr().solve(right);
  std::vector<double> out(at.front().size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t s = 0; s < x.size(); ++s) {
      const auto [row, own] = hat(at, s, i);
      out[i] += own.dot(value.segment<2>(row));
    }
  }
  return out;
}

}  // namespace flexor::score
