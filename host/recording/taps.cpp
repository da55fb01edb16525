#include "host/recording/taps.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace flexor::recording {
namespace {

constexpr double kOutliers = 0.02;  // share of the readings beyond either end of the range
constexpr double kSwing = 0.25;     // least, of the range
constexpr double kRests = 0.1;      // most, of the range
constexpr double kRest_s = 1;
constexpr double kNear_s = 0.8;  // from the first and the last bend to the rest beside it
constexpr double kLeastApart_s = 0.3;
constexpr double kMostApart_s = 1.5;
constexpr double kUneven = 1.6;

struct Turn {
  double t_s;
  double value;
};

double range_of(const Series& series) {
  std::vector<double> sorted(series.value.begin(), series.value.end());
  std::ranges::sort(sorted);
  const auto tail = static_cast<std::size_t>(kOutliers * static_cast<double>(sorted.size()));
  return sorted[sorted.size() - 1 - tail] - sorted[tail];
}

// Extremes with at least `swing` between one and the next.
std::vector<Turn> turns_of(const Series& series, double swing) {
  std::vector<Turn> out;
  Turn low{series.t_s.front(), series.value.front()};
  Turn high = low;
  int direction = 0;
  for (std::size_t i = 0; i < series.t_s.size(); ++i) {
    const Turn now{series.t_s[i], series.value[i]};
    if (now.value > high.value) high = now;
    if (now.value < low.value) low = now;
    if (direction >= 0 && now.value <= high.value - swing) {
      if (direction > 0) out.push_back(high);
      direction = -1;
      low = now;
    } else if (direction <= 0 && now.value >= low.value + swing) {
      if (direction < 0) out.push_back(low);
      direction = 1;
      high = now;
    } else {
      continue;
    }
    (direction > 0 ? low : high) = now;
  }
  return out;
}

// Whether the series keeps its place there, at least `swing` from where a bend turns back.
bool rests(const Series& series, double from_s, double to_s, double range, const Turn& bend) {
  const auto from = std::ranges::lower_bound(series.t_s, from_s) - series.t_s.begin();
  const auto to = std::ranges::upper_bound(series.t_s, to_s) - series.t_s.begin();
  if (to - from < 2) return false;
  const auto [low, high] = std::minmax_element(series.value.begin() + from, series.value.begin() + to);
  return *high - *low <= kRests * range &&
         std::min(std::abs(*high - bend.value), std::abs(*low - bend.value)) >= kSwing * range;
}

}  // namespace

std::optional<std::array<double, 3>> taps(const Series& series) {
  const double range = range_of(series);
  if (!(range > 0)) return std::nullopt;
  const std::vector<Turn> turns = turns_of(series, kSwing * range);
  std::optional<std::array<double, 3>> found;
  for (std::size_t i = 0; i + 4 < turns.size(); ++i) {
    const std::array<double, 3> t = {turns[i].t_s, turns[i + 2].t_s, turns[i + 4].t_s};
    const double first = t[1] - t[0];
    const double second = t[2] - t[1];
    const auto [shorter, longer] = std::minmax(first, second);
    if (shorter < kLeastApart_s || longer > kMostApart_s || longer > kUneven * shorter) continue;
    if (!rests(series, t[0] - kNear_s - kRest_s, t[0] - kNear_s, range, turns[i])) continue;
    if (!rests(series, t[2] + kNear_s, t[2] + kNear_s + kRest_s, range, turns[i + 4])) continue;
    if (found) return std::nullopt;
    found = t;
  }
  return found;
}

}  // namespace flexor::recording
