#include "host/donning/window.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::donning {

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

Window window_of(std::span<const double> readings, std::span<const double> shares, double turn) {
  std::vector<double> sorted(readings.begin(), readings.end());
  std::ranges::sort(sorted);
  Window out;
  for (const double share : shares) out.quantile.push_back(quantile_of(sorted, share));
  out.turns = turns_of(readings, turn);
  return out;
}

}  // namespace flexor::donning
