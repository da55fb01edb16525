#include "host/score/trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

constexpr double kFine_s = 0.005;
constexpr int kCoarse = 8;  // fine steps
constexpr int kFirst = -40;
constexpr int kLast = 120;
static_assert((kLast - kFirst) % kCoarse == 0 && -kFirst % kCoarse == 0);

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

void require_alike(std::span<const std::vector<float>> reference, std::span<const std::vector<float>> hand) {
  const auto alike = [&](const std::vector<float>& series) { return series.size() == reference[0].size(); };
  if (reference.empty() || reference.size() != hand.size() || reference[0].size() < 2 ||
      !std::ranges::all_of(reference, alike) || !std::ranges::all_of(hand, alike))
    throw io::JobError("a trial's score needs at least two frames, as many of the hand as of the glove");
}

}  // namespace

TrialScore score_trial(std::span<const std::vector<float>> reference,
                       std::span<const std::vector<float>> hand, double period_s) {
  require_alike(reference, hand);
  TrialScore s;
  const auto total = [&](double lag_s) {
    double sum = 0;
    for (std::size_t i = 0; i < reference.size(); ++i)
      sum += error_of_finger(reference[i], hand[i], period_s, lag_s);
    return sum;
  };
  for (std::size_t i = 0; i < reference.size(); ++i)
    s.finger_error_deg_s.push_back(error_of_finger(reference[i], hand[i], period_s, 0));
  s.total_error_deg_s = std::accumulate(s.finger_error_deg_s.begin(), s.finger_error_deg_s.end(), 0.0);
  LagRemoved best{0, s.total_error_deg_s};
  const auto search = [&](int from, int to, int step) {  // in steps of kFine_s
    for (int k = from; k <= to; k += step) {
      const double lag_s = k * kFine_s;
      const double error = total(lag_s);
      if (error < best.total_error_deg_s) best = {lag_s, error};
    }
  };
  search(kFirst, kLast, kCoarse);
  const auto coarse = static_cast<int>(std::lround(best.lag_s / kFine_s));
  search(std::max(coarse - kCoarse + 1, kFirst), std::min(coarse + kCoarse - 1, kLast), 1);
  const auto found = static_cast<int>(std::lround(best.lag_s / kFine_s));
  if (found > kFirst && found < kLast) s.lag_removed = best;
  return s;
}

}  // namespace flexor::score
