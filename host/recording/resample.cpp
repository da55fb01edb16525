#include "host/recording/resample.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace flexor::recording {

Resampler::Resampler(std::size_t columns, double period_s, double max_gap_s)
    : period_s_(period_s),
      max_gap_s_(max_gap_s),
      tolerance_s_(std::min(kTolerance_s, period_s / 8)),
      sum_(columns),
      held_(columns) {
  assert(period_s > 0 && max_gap_s > 0);
}

void Resampler::take(double t_s, std::span<const double> value) {
  assert(value.size() == sum_.size());
  for (std::size_t i = 0; i < value.size(); ++i) sum_[i] += value[i];
  ++count_;
  newest_s_ = t_s;
}

void Resampler::close_cell() {
  if (count_ == 0) return;
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    held_[i] = sum_[i] / static_cast<double>(count_);
    sum_[i] = 0;
  }
  count_ = 0;
}

Samples resample(const Series& series, double period_s, double max_gap_s) {
  Samples out;
  Resampler resampler(1, period_s, max_gap_s);
  for (std::size_t i = 0; i < series.t_s.size(); ++i) {
    resampler.push(series.t_s[i], series.value.subspan(i, 1), [&](const Sample& s) {
      out.t_s.push_back(s.t_s);
      out.value.push_back(s.value[0]);
      out.pause.push_back(s.pause);
    });
  }
  return out;
}

std::vector<double> since_start(std::span<const double> t_s) {
  std::vector<double> out;
  out.reserve(t_s.size());
  for (const double t : t_s) out.push_back(std::round((t - t_s.front()) * 1e6) / 1e6);
  return out;
}

double default_max_gap_s(std::span<const double> t_s) {
  if (t_s.size() < 3) return 0.3;
  std::vector<double> steps;
  steps.reserve(t_s.size());
  for (std::size_t i = 1; i < t_s.size(); ++i) steps.push_back(t_s[i] - t_s[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return std::max(0.3, 5 * *middle);
}

}  // namespace flexor::recording
