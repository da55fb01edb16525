#include "host/recording/resample.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace flexor::recording {

Resampled resample(const Series& series, const Grid& grid, double max_gap_s) {
  const auto t = series.t_s;
  const auto x = series.value;
  assert(!t.empty() && t.size() == x.size() && grid.period_s > 0);
  Resampled out;
  out.value.resize(grid.size);
  out.gap.resize(grid.size);
  std::size_t next = 0;        // first sample at or after the grid point
  std::size_t cell_begin = 0;  // first sample of the cell around the grid point
  for (std::size_t k = 0; k < grid.size; ++k) {
    const double now = grid.time(k);
    while (next < t.size() && t[next] < now) ++next;
    while (cell_begin < t.size() && t[cell_begin] < now - grid.period_s / 2) ++cell_begin;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = cell_begin; i < t.size() && t[i] < now + grid.period_s / 2; ++i, ++count)
      sum += x[i];

    const bool inside = next > 0 && next < t.size();
    const std::size_t before = next > 0 ? next - 1 : 0;
    const std::size_t after = std::min(next, t.size() - 1);
    out.gap[k] = count == 0 && (!inside || t[after] - t[before] > max_gap_s);
    if (inside && t[after] - t[before] > max_gap_s) out.gap[k] = 1;
    if (count > 0) {
      out.value[k] = sum / static_cast<double>(count);
    } else if (inside) {
      const double share = (now - t[before]) / (t[after] - t[before]);
      out.value[k] = x[before] + share * (x[after] - x[before]);
    } else {
      out.value[k] = x[after];
      if (next > 0) out.value[k] = x[before];
    }
  }
  return out;
}

std::vector<double> since_start(std::span<const double> t_s) {
  std::vector<double> out;
  for (const double t : t_s) out.push_back(std::round((t - t_s.front()) * 1e6) / 1e6);
  return out;
}

double default_max_gap_s(std::span<const double> t_s) {
  if (t_s.size() < 3) return 0.3;
  std::vector<double> steps;
  for (std::size_t i = 1; i < t_s.size(); ++i) steps.push_back(t_s[i] - t_s[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return std::max(0.3, 5 * *middle);
}

}  // namespace flexor::recording
