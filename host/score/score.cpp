#include "host/score/score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "host/io/io.hpp"

namespace flexor::score {
namespace {

constexpr double kMaxLag_s = 1.0;
constexpr int kLagSteps = 80;  // over [-kMaxLag_s, kMaxLag_s], then a parabola

double integral_of_absolute(std::span<const double> t_s, std::span<const double> error) {
  double sum = 0;
  for (std::size_t k = 1; k < t_s.size(); ++k) {
    sum += (std::abs(error[k]) + std::abs(error[k - 1])) / 2 * (t_s[k] - t_s[k - 1]);
  }
  return sum;
}

double root_mean_square(std::span<const double> error) {
  double sum = 0;
  for (const double e : error) sum += e * e;
  return std::sqrt(sum / static_cast<double>(error.size()));
}

// Errors against the estimate taken lag_s later.
std::vector<double> error_at_lag(std::span<const double> t_s, std::span<const double> measured,
                                 std::span<const double> estimated, double lag_s) {
  std::vector<double> error(t_s.size());
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    error[k] = measured[k] - interpolate(t_s, estimated, t_s[k] + lag_s);
  }
  return error;
}

double best_lag(std::span<const double> t_s, std::span<const double> measured,
                std::span<const double> estimated) {
  const double step = 2 * kMaxLag_s / kLagSteps;
  std::vector<double> costs;
  for (int i = 0; i <= kLagSteps; ++i) {
    costs.push_back(root_mean_square(error_at_lag(t_s, measured, estimated, i * step - kMaxLag_s)));
  }
  const auto best = std::ranges::min_element(costs) - costs.begin();
  const double on_grid = static_cast<double>(best) * step - kMaxLag_s;
  if (best == 0 || best == kLagSteps) return on_grid;
  const auto b = static_cast<std::size_t>(best);
  const double left = costs[b - 1] * costs[b - 1];
  const double right = costs[b + 1] * costs[b + 1];
  const double curvature = left - 2 * costs[b] * costs[b] + right;
  if (!(curvature > 0)) return on_grid;
  const double refined = on_grid + step * (left - right) / (2 * curvature);
  const bool better = root_mean_square(error_at_lag(t_s, measured, estimated, refined)) < costs[b];
  return better ? refined : on_grid;
}

}  // namespace

double interpolate(std::span<const double> t_s, std::span<const double> value, double at_s) {
  const auto next = std::ranges::lower_bound(t_s, at_s) - t_s.begin();
  if (next == 0) return value.front();
  if (next == std::ssize(t_s)) return value.back();
  const auto n = static_cast<std::size_t>(next);
  const double share = (at_s - t_s[n - 1]) / (t_s[n] - t_s[n - 1]);
  return value[n - 1] + share * (value[n] - value[n - 1]);
}

Score score(std::span<const double> t_s, std::span<const double> measured_deg,
            std::span<const double> estimated_deg) {
  assert(t_s.size() >= 2 && t_s.size() == measured_deg.size() && t_s.size() == estimated_deg.size());
  const auto n = static_cast<double>(t_s.size());
  double mean = 0;
  for (const double y : measured_deg) mean += y / n;
  double variance = 0;
  for (const double y : measured_deg) variance += (y - mean) * (y - mean) / n;
  if (!(variance > 0)) throw io::JobError("the measured angle never changes: there is nothing to score");

  const std::vector<double> error = error_at_lag(t_s, measured_deg, estimated_deg, 0);
  std::vector<double> absolute(error.size());
  std::ranges::transform(error, absolute.begin(), [](double e) { return std::abs(e); });
  const auto p95 = absolute.begin() + static_cast<std::ptrdiff_t>(0.95 * (n - 1));

  Score s;
  s.samples = t_s.size();
  s.rmse_deg = root_mean_square(error);
  s.max_abs_deg = std::ranges::max(absolute);
  std::nth_element(absolute.begin(), p95, absolute.end());
  s.p95_abs_deg = *p95;
  s.fit_percent = 100 * (1 - s.rmse_deg / std::sqrt(variance));
  s.r2 = 1 - s.rmse_deg * s.rmse_deg / variance;
  s.iae_deg_s = integral_of_absolute(t_s, error);
  s.best_lag_s = best_lag(t_s, measured_deg, estimated_deg);
  s.lag_at_edge = std::abs(s.best_lag_s) > kMaxLag_s - 1e-9;
  const auto aligned = error_at_lag(t_s, measured_deg, estimated_deg, s.best_lag_s);
  s.lag_removed_rmse_deg = root_mean_square(aligned);
  s.lag_removed_iae_deg_s = integral_of_absolute(t_s, aligned);
  return s;
}

Score compare(std::span<const double> measured_t_s, std::span<const double> measured_deg,
              std::span<const double> estimated_t_s, std::span<const double> estimated_deg) {
  const auto first = std::ranges::lower_bound(estimated_t_s, measured_t_s.front()) - estimated_t_s.begin();
  const auto last = std::ranges::upper_bound(estimated_t_s, measured_t_s.back()) - estimated_t_s.begin();
  if (last - first < 2) {
    throw io::InputError(fmt::format(
        "the two do not overlap in time: measured {:.1f} to {:.1f} s, estimated {:.1f} to {:.1f} s",
        measured_t_s.front(), measured_t_s.back(), estimated_t_s.front(), estimated_t_s.back()));
  }
  const auto count = static_cast<std::size_t>(last - first);
  const auto t_s = estimated_t_s.subspan(static_cast<std::size_t>(first), count);
  std::vector<double> measured;
  measured.reserve(count);
  for (const double t : t_s) measured.push_back(interpolate(measured_t_s, measured_deg, t));
  return score(t_s, measured, estimated_deg.subspan(static_cast<std::size_t>(first), count));
}

nlohmann::ordered_json to_json(const Score& s) {
  return {{"rmse_deg", s.rmse_deg},
          {"fit_percent", s.fit_percent},
          {"r2", s.r2},
          {"max_abs_deg", s.max_abs_deg},
          {"p95_abs_deg", s.p95_abs_deg},
          {"iae_deg_s", s.iae_deg_s},
          {"best_lag_s", s.best_lag_s},
          {"lag_at_edge", s.lag_at_edge},
          {"lag_removed_rmse_deg", s.lag_removed_rmse_deg},
          {"lag_removed_iae_deg_s", s.lag_removed_iae_deg_s},
          {"samples", s.samples}};
}

}  // namespace flexor::score
