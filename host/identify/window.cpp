#include "host/identify/window.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::identify {

double quantile_of(std::span<const double> sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  if (i + 1 >= sorted.size()) return sorted.back();
  return sorted[i] + (at - static_cast<double>(i)) * (sorted[i + 1] - sorted[i]);
}

Turns turns_of(std::span<const double> readings, double turn) {
  Turns out;
  int way = 0;  // of the motion: 1 up, -1 down, 0 not known
  double low = readings.front();
  double high = readings.front();
  std::vector<double> end;  // of each way
  for (const double u : readings) {
    low = std::min(low, u);
    high = std::max(high, u);
    const bool down = way >= 0 && u <= high - turn;
    const bool up = way <= 0 && u >= low + turn;
    if (!down && !up) continue;
    if (way > 0) out.high.push_back(high);
    if (way < 0) out.low.push_back(low);
    end.push_back(up ? low : high);
    (up ? out.low_ends : out.high_ends).push_back(up ? low : high);
    way = up ? 1 : -1;
    low = high = u;
  }
  if (way != 0) {
    end.push_back(way > 0 ? high : low);
    (way > 0 ? out.high_ends : out.low_ends).push_back(way > 0 ? high : low);
  }
  for (std::size_t i = 2; i < end.size(); ++i) {
    const double shorter = std::min(std::abs(end[i] - end[i - 1]), std::abs(end[i - 1] - end[i - 2]));
    out.there_and_back = std::max(out.there_and_back, shorter);
  }
  return out;
}

model::Spread spread_of(std::vector<double> readings, std::span<const double> shares) {
  std::ranges::sort(readings);
  model::Spread out{{shares.begin(), shares.end()}, {}};
  for (const double share : shares) out.reading.push_back(quantile_of(readings, share));
  return out;
}

model::Spread spread_of(const model::Poses& poses) {
  const auto [low, high] = std::minmax(poses.open, poses.fist);
  return {{0.05, 0.95}, {low, high}};
}

Window window_of(std::span<const double> readings, std::span<const double> shares, double turn) {
  return {spread_of({readings.begin(), readings.end()}, shares), turns_of(readings, turn)};
}

double add_squares(double sum, const std::vector<double>& values, double unit) {
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) sum += (v - mean) * (v - mean) / unit;
  return sum;
}

}  // namespace flexor::identify
