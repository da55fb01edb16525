#include "host/score/score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "host/io/io.hpp"
#include "host/io/numbers.hpp"
#include "host/score/judge.hpp"

namespace flexor::score {
namespace {

constexpr double kMaxLag_s = 1.0;
constexpr int kMiddle = 40;             // of the lags
constexpr int kLagSteps = 2 * kMiddle;  // over [-kMaxLag_s, kMaxLag_s], then a parabola
constexpr double kMinOverlap_s = 1.0;

double integral_of_absolute(std::span<const double> t_s, std::span<const double> error, double max_step_s) {
  double sum = 0;
  for (std::size_t k = 1; k < t_s.size(); ++k) {
    const double step = t_s[k] - t_s[k - 1];
    if (step <= max_step_s) sum += (std::abs(error[k]) + std::abs(error[k - 1])) / 2 * step;
  }
  return sum;
}

struct Errors {
  std::vector<double> t_s;
  std::vector<double> deg;
};

// Of the estimate at t against the measured angle at t - lag_s, where there is one.
Errors error_at_lag(std::span<const double> t_s, std::span<const double> measured,
                    std::span<const double> estimated, double lag_s) {
  Errors out;
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    const double at_s = t_s[k] - lag_s;
    if (at_s < t_s.front() || at_s > t_s.back()) continue;
    out.t_s.push_back(t_s[k]);
    out.deg.push_back((lag_s == 0 ? measured[k] : io::interpolate(t_s, measured, at_s)) - estimated[k]);
  }
  return out;
}

// Into best_lag_s and lag_at_edge.
void find_lag(std::span<const double> t_s, std::span<const double> measured,
              std::span<const double> estimated, Score& out) {
  const double step = 2 * kMaxLag_s / kLagSteps;
  const auto cost = [&](double lag_s) {
    const Errors e = error_at_lag(t_s, measured, estimated, lag_s);
    // At least half of the samples: an end of the recording alone may fit by chance.
    return 2 * e.deg.size() < t_s.size() ? std::numeric_limits<double>::infinity() : std::pow(rms(e.deg), 2);
  };
  std::vector<double> costs;
  for (int i = 0; i <= kLagSteps; ++i) costs.push_back(cost((i - kMiddle) * step));
  const auto best = std::ranges::min_element(costs) - costs.begin();
  out.best_lag_s = static_cast<double>(best - kMiddle) * step;
  out.lag_at_edge = best <= 1 || best + 1 >= kLagSteps;
  if (best == 0 || best == kLagSteps) return;
  const auto b = static_cast<std::size_t>(best);
  const double curvature = costs[b - 1] - 2 * costs[b] + costs[b + 1];
  if (!(curvature > 0) || !std::isfinite(curvature)) return;
  const double refined = out.best_lag_s + step * (costs[b - 1] - costs[b + 1]) / (2 * curvature);
  if (cost(refined) < costs[b]) out.best_lag_s = refined;
}

// Rows of one time as their mean.
void merge_equal_times(const Angles& in, std::vector<double>& t_s, std::vector<double>& angle_deg) {
  for (std::size_t k = 0; k < in.t_s.size();) {
    std::size_t next = k;
    double sum = 0;
    for (; next < in.t_s.size() && in.t_s[next] == in.t_s[k]; ++next) sum += in.angle_deg[next];
    t_s.push_back(in.t_s[k]);
    angle_deg.push_back(sum / static_cast<double>(next - k));
    k = next;
  }
}

}  // namespace

Score score(std::span<const double> t_s, std::span<const double> measured_deg,
            std::span<const double> estimated_deg, double max_step_s) {
  assert(t_s.size() >= 2 && t_s.size() == measured_deg.size() && t_s.size() == estimated_deg.size());
  const auto n = static_cast<double>(t_s.size());
  double mean = 0;
  for (const double y : measured_deg) mean += y / n;
  double variance = 0;
  for (const double y : measured_deg) variance += (y - mean) * (y - mean) / n;
  const auto [least, most] = std::ranges::minmax(measured_deg);
  if (!(most > least)) variance = std::numeric_limits<double>::quiet_NaN();  // its mean may be rounded

  const std::vector<double> error = error_at_lag(t_s, measured_deg, estimated_deg, 0).deg;
  std::vector<double> absolute(error.size());
  std::ranges::transform(error, absolute.begin(), [](double e) { return std::abs(e); });
  const auto p95 = absolute.begin() + static_cast<std::ptrdiff_t>(0.95 * (n - 1));

  Score s;
  s.samples = t_s.size();
  s.rmse_deg = rms(error);
  s.max_abs_deg = std::ranges::max(absolute);
  std::nth_element(absolute.begin(), p95, absolute.end());
  s.p95_abs_deg = *p95;
  s.fit_percent = 100 * (1 - s.rmse_deg / std::sqrt(variance));
  s.r2 = 1 - s.rmse_deg * s.rmse_deg / variance;
  s.iae_deg_s = integral_of_absolute(t_s, error, max_step_s);
  find_lag(t_s, measured_deg, estimated_deg, s);
  const Errors aligned = error_at_lag(t_s, measured_deg, estimated_deg, s.best_lag_s);
  s.lag_removed_rmse_deg = rms(aligned.deg);
  s.lag_removed_iae_deg_s = integral_of_absolute(aligned.t_s, aligned.deg, max_step_s);
  return s;
}

Score score_seen(std::span<const double> t_s, std::span<const double> measured_deg,
                 std::span<const double> estimated_deg, std::span<const std::uint8_t> unseen,
                 double max_step_s) {
  std::vector<double> t;
  std::vector<double> measured;
  std::vector<double> estimated;
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    if (unseen[k] != 0) continue;
    t.push_back(t_s[k]);
    measured.push_back(measured_deg[k]);
    estimated.push_back(estimated_deg[k]);
  }
  if (t.size() < 2 || std::ranges::min(measured) == std::ranges::max(measured))
    return score(t_s, measured_deg, estimated_deg, max_step_s);
  Score out = score(t, measured, estimated, max_step_s);
  out.left_out = t_s.size() - t.size();
  return out;
}

std::optional<std::string> in_words_left_out(std::size_t unseen, std::size_t of, const char* done) {
  const double share = static_cast<double>(unseen) / static_cast<double>(of);
  if (!(share >= 0.01)) return {};
  return fmt::format("in {:.0f} % of what is {} nothing was measured: that is left out", 100 * share, done);
}

Score compare(const Angles& measured, const Angles& estimated) {
  std::vector<double> reference_t_s;
  std::vector<double> reference_deg;
  merge_equal_times(measured, reference_t_s, reference_deg);
  std::vector<double> t_s;
  std::vector<double> measured_deg;
  std::vector<double> estimated_deg;
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < estimated.t_s.size(); ++k) {
    const double now = estimated.t_s[k];
    if (now < reference_t_s.front() || now > reference_t_s.back()) continue;
    const auto next = std::ranges::lower_bound(reference_t_s, now);
    if (*next > now && *next - *(next - 1) > measured.max_gap_s) {
      ++left_out;
      continue;
    }
    t_s.push_back(now);
    measured_deg.push_back(io::interpolate(reference_t_s, reference_deg, now));
    estimated_deg.push_back(estimated.angle_deg[k]);
  }
  for (const double now : reference_t_s) {
    const auto next = std::ranges::lower_bound(estimated.t_s, now);
    if (next == estimated.t_s.begin() || next == estimated.t_s.end()) continue;
    left_out += *next > now && *next - *(next - 1) > estimated.max_gap_s;
  }
  if (t_s.size() < 2 || t_s.back() - t_s.front() < kMinOverlap_s)
    throw io::InputError(
        "the two overlap by less than {:g} s: measured {:.1f} to {:.1f} s, estimated {:.1f} to {:.1f} s",
        kMinOverlap_s, reference_t_s.front(), reference_t_s.back(), estimated.t_s.front(),
        estimated.t_s.back());
  if (const auto [least, most] = std::ranges::minmax(measured_deg); least == most)
    throw io::JobError("the measured angle is {:g} deg throughout: where nothing moves no fit can be judged",
                       least);
  Score s = score(t_s, measured_deg, estimated_deg, std::max(measured.max_gap_s, estimated.max_gap_s));
  s.left_out = left_out;
  return s;
}

}  // namespace flexor::score
