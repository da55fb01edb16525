#include "host/score/trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

constexpr double kCoarse_s = 0.04;
constexpr double kFine_s = 0.005;

double error_of_finger(const std::vector<float>& reference, const std::vector<float>& hand, double period_s,
                       double lag_s) {
  const auto n = static_cast<std::ptrdiff_t>(reference.size());
  const double frames = lag_s / period_s;
  const auto whole = static_cast<std::ptrdiff_t>(std::floor(frames));
  const auto part = static_cast<float>(frames - std::floor(frames));
  double sum = 0;
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const float before = hand[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(k + whole, 0, n - 1))];
    const float after = hand[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(k + whole + 1, 0, n - 1))];
    const double e = std::abs(
        static_cast<double>(reference[static_cast<std::size_t>(k)] - (before + part * (after - before))));
    sum += k == 0 || k == n - 1 ? e / 2 : e;
  }
  return sum * period_s;
}

}  // namespace

TrialScore score_trial(std::span<const std::vector<float>> reference,
                       std::span<const std::vector<float>> hand, double period_s) {
  const auto alike = [&](const std::vector<float>& series) { return series.size() == reference[0].size(); };
  if (reference.empty() || reference.size() != hand.size() || reference[0].size() < 2 ||
      !std::ranges::all_of(reference, alike) || !std::ranges::all_of(hand, alike)) {
    throw io::JobError("a trial's score needs at least two frames, as many of the hand as of the glove");
  }
  const auto total = [&](double lag_s) {
    double sum = 0;
    for (std::size_t i = 0; i < reference.size(); ++i) {
      sum += error_of_finger(reference[i], hand[i], period_s, lag_s);
    }
    return sum;
  };
  TrialScore s;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    s.finger_error_deg_s.push_back(error_of_finger(reference[i], hand[i], period_s, 0));
    s.total_error_deg_s += s.finger_error_deg_s.back();
  }
  s.lag_removed_deg_s = s.total_error_deg_s;
  const auto search = [&](double from_s, double to_s, double step_s) {
    const auto steps = static_cast<int>(std::lround((to_s - from_s) / step_s));
    for (int k = 0; k <= steps; ++k) {
      const double lag_s = from_s + k * step_s;
      const double error = total(lag_s);
      if (error < s.lag_removed_deg_s) {
        s.lag_removed_deg_s = error;
        s.lag_s = lag_s;
      }
    }
  };
  search(kMinTrialLag_s, kMaxTrialLag_s, kCoarse_s);
  const double coarse_s = s.lag_s;
  search(coarse_s - kCoarse_s + kFine_s, coarse_s + kCoarse_s - kFine_s, kFine_s);
  return s;
}

}  // namespace flexor::score
