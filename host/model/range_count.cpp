#include "host/model/range_count.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {

RangeCount::RangeCount(const Model& model) : counts_(model.inputs.size()) {
  constexpr std::size_t kMostCrossed = 32;  // a square of them is counted in each row
  for (const Input& input : model.inputs) ranges_.emplace_back(input.valid_min, input.valid_max);
  if (counts_.size() > kMostCrossed) return;
  crossed_.assign(counts_.size(), std::vector<std::uint64_t>(counts_.size()));
}

bool RangeCount::is_outside(double reading, std::size_t input) const {
  return reading < ranges_[input].first || reading > ranges_[input].second;
}

void RangeCount::add(std::span<const double> reading) {
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (std::isnan(reading[i])) continue;
    InputCount& count = counts_[i];
    count.low = count.readings > 0 ? std::min(count.low, reading[i]) : reading[i];
    count.high = count.readings > 0 ? std::max(count.high, reading[i]) : reading[i];
    ++count.readings;
    if (is_outside(reading[i], i)) ++count.outside;
    for (std::size_t j = 0; j < crossed_.size(); ++j) {
      if (is_outside(reading[i], j)) ++crossed_[i][j];
    }
  }
}

std::optional<std::pair<std::size_t, std::size_t>> RangeCount::exchanged() const {
  constexpr std::uint64_t kFewer = 10;
  std::optional<std::pair<std::size_t, std::size_t>> best;
  std::uint64_t most_saved = 0;
  for (std::size_t i = 0; i < crossed_.size(); ++i) {
    for (std::size_t j = i + 1; j < crossed_.size(); ++j) {
      if (!counts_[i].mostly_outside() && !counts_[j].mostly_outside()) continue;
      const std::uint64_t before = counts_[i].outside + counts_[j].outside;
      const std::uint64_t after = crossed_[i][j] + crossed_[j][i];
      if (kFewer * after > before || before - after <= most_saved) continue;
      most_saved = before - after;
      best = {i, j};
    }
  }
  return best;
}

}  // namespace flexor::model
