#include "host/recording/resample.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace flexor::recording {

Resampler::Resampler(const std::vector<Range>& ranges, double period_s, double max_gap_s)
    : period_s_(period_s),
      max_gap_s_(max_gap_s),
      tolerance_s_(std::min(kTolerance_s, period_s / 8)),
      held_(ranges.size()) {
  assert(period_s > 0 && max_gap_s > 0);
  for (const Range& range : ranges) columns_.push_back({range});
}

void Resampler::take(double t_s, std::span<const double> value) {
  assert(value.size() == columns_.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    Column& c = columns_[i];
    if (value[i] >= c.range.min && value[i] <= c.range.max) {
      c.sum += value[i];
      ++c.count;
    } else {
      c.refused = value[i];
    }
  }
  read_ = true;
  newest_s_ = t_s;
}

void Resampler::close_cell() {
  if (!read_) return;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    Column& c = columns_[i];
    held_[i] = c.count > 0 ? c.sum / static_cast<double>(c.count) : c.refused;
    c.sum = 0;
    c.count = 0;
  }
  read_ = false;
}

Samples resample(const Series& series, double period_s, double max_gap_s, const Range& range) {
  Samples out;
  Resampler resampler({range}, period_s, max_gap_s);
  for (std::size_t i = 0; i < series.t_s.size(); ++i) {
    resampler.push(series.t_s[i], series.value.subspan(i, 1), [&](const Sample& s) {
      out.t_s.push_back(s.t_s);
      out.value.push_back(s.value[0]);
      out.pause.push_back(s.pause);
    });
  }
  return out;
}

std::vector<double> held_over(std::vector<double> value, double otherwise) {
  const auto first = std::ranges::find_if_not(value, [](double v) { return std::isnan(v); });
  double last = first == value.end() ? otherwise : *first;
  for (double& v : value) last = v = std::isnan(v) ? last : v;
  return value;
}

std::vector<double> since_start(std::span<const double> t_s) {
  std::vector<double> out;
  out.reserve(t_s.size());
  for (const double t : t_s) out.push_back(std::round((t - t_s.front()) * 1e6) / 1e6);
  return out;
}

double default_max_gap_s(std::span<const double> t_s) {
  constexpr double kLeast_s = 0.3;
  constexpr double kFew = 0.05;     // of the steps
  constexpr double kBursts = 0.95;  // of the time: more passes between bursts of rows
  std::vector<double> steps;
  steps.reserve(t_s.size());
  for (std::size_t i = 1; i < t_s.size(); ++i) {
    const double step = t_s[i] - t_s[i - 1];
    if (step > 0 && step <= kJump_s) steps.push_back(step);
  }
  std::ranges::sort(steps);
  while (!steps.empty()) {
    const double all_s = std::accumulate(steps.begin(), steps.end(), 0.0);
    double left = all_s / 2;
    auto step = steps.begin();
    while ((left -= *step) > 0 && step + 1 != steps.end()) ++step;
    const auto longer = std::ranges::lower_bound(steps, *step / 2);
    if (static_cast<double>(steps.end() - longer) >= kFew * static_cast<double>(steps.size()) ||
        std::accumulate(longer, steps.end(), 0.0) > kBursts * all_s)
      return std::max(kLeast_s, 5 * *step);
    steps.erase(longer, steps.end());
  }
  return kLeast_s;
}

std::vector<std::size_t> ends_of_ways(std::span<const double> value, double turn) {
  std::vector<std::size_t> out;
  int way = 0;  // 1 up, -1 down, 0 not known
  std::size_t low = 0;
  std::size_t high = 0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    if (value[k] < value[low]) low = k;
    if (value[k] > value[high]) high = k;
    const bool down = way >= 0 && value[k] <= value[high] - turn;
    const bool up = way <= 0 && value[k] >= value[low] + turn;
    if (!down && !up) continue;
    out.push_back(up ? low : high);
    way = up ? 1 : -1;
    low = high = k;
  }
  if (way != 0) out.push_back(way > 0 ? high : low);
  return out;
}

Range without_spikes(std::span<const double> value) {
  constexpr double kSpikes = 0.01;  // share of the readings at either end that may be spikes
  constexpr double kFar = 3;
  std::vector<double> sorted(value.begin(), value.end());
  std::erase_if(sorted, [](double v) { return std::isnan(v); });
  if (sorted.empty()) return {};
  std::ranges::sort(sorted);
  const auto tail = static_cast<std::size_t>(kSpikes * static_cast<double>(sorted.size()));
  const double low = sorted[tail];
  const double high = sorted[sorted.size() - 1 - tail];
  const double far = kFar * (high - low);
  const auto first = far > 0 ? std::ranges::lower_bound(sorted, low - far) : sorted.begin();
  const auto last = far > 0 ? std::ranges::upper_bound(sorted, high + far) : sorted.end();
  return {*first, *(last - 1)};
}

std::vector<std::uint8_t> without_jumps(const Series& series) {
  constexpr std::size_t kMostFrames = 2;
  constexpr double kRange_s = 0.08;
  constexpr double kLeast = 0.3;  // of the range
  constexpr double kFar = 5;
  constexpr double kNear = 0.3;  // of the jump: from where it came, and what the finger itself moves
  std::vector<std::uint8_t> out(series.value.size(), 1);
  std::vector<std::size_t> at;  // where something was read
  for (std::size_t k = 0; k < out.size(); ++k)
    if (!std::isnan(series.value[k])) at.push_back(k);
  if (at.size() < 5) return out;
  const auto step = [&](std::size_t from, std::size_t to) {
    return series.value[at[to]] - series.value[at[from]];
  };
  std::vector<double> sizes;
  for (std::size_t i = 1; i < at.size(); ++i) sizes.push_back(std::abs(step(i - 1, i)));
  const auto nearly_all = sizes.begin() + std::ssize(sizes) * 19 / 20;
  std::ranges::nth_element(sizes, nearly_all);
  const Range range = without_spikes(series.value);
  const auto is_far = [&](std::size_t i) {  // the step to at[i]
    const double share = std::max(kLeast, (series.t_s[at[i]] - series.t_s[at[i - 1]]) / kRange_s);
    return std::abs(step(i - 1, i)) > std::max(kFar * *nearly_all, share * (range.max - range.min));
  };
  for (std::size_t i = 2; i + 1 < at.size(); ++i) {
    const double near = kNear * std::abs(step(i - 1, i));
    for (std::size_t j = i + 1; is_far(i) && j <= i + kMostFrames && j + 1 < at.size(); ++j) {
      const bool is_flat = std::abs(step(i, j - 1)) < near;
      const bool is_still = std::abs(step(i - 2, i - 1)) < near && std::abs(step(j, j + 1)) < near;
      if (!is_far(j) || !is_flat || !is_still || std::abs(step(i - 1, j)) > near) continue;
      while (i < j) out[at[i++]] = 0;
      break;
    }
  }
  return out;
}

}  // namespace flexor::recording
