#include "host/model/range_count.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::model {
namespace {

constexpr std::size_t kMostKept = 1024;  // rows; then every other goes
constexpr double kCloser = 3;
constexpr double kFar = 0.15;  // of the span; a glove that was put on again moves its readings by a seventh

Spread known(const Input& input) {
  return input.readings.value_or(Spread{{0, 1}, {input.valid_min, input.valid_max}});
}

}  // namespace

RangeCount::RangeCount(const Model& model) : inputs_(model.inputs), counts_(model.inputs.size()) {}

void RangeCount::add(std::span<const double> reading) {
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    const double u = reading[i];
    if (std::isnan(u)) continue;
    InputCount& count = counts_[i];
    count.low = count.readings > 0 ? std::min(count.low, u) : u;
    count.high = count.readings > 0 ? std::max(count.high, u) : u;
    ++count.readings;
    if (u < inputs_[i].valid_min || u > inputs_[i].valid_max) ++count.outside;
    const auto& made = inputs_[i].readings;
    if (made && std::abs(u - made->middle()) > 0.6 * made->span()) ++count.beyond;
  }
  if (rows_++ % stride_ != 0) return;
  kept_.emplace_back(reading.begin(), reading.end());
  if (kept_.size() < kMostKept) return;
  for (std::size_t k = 1; k < kMostKept / 2; ++k) kept_[k] = std::move(kept_[2 * k]);
  kept_.resize(kMostKept / 2);
  stride_ *= 2;
}

// Mean difference of the column's quantiles from those of the input's readings, in spans of these.
double RangeCount::distance(std::size_t column, std::size_t input, bool mirrored) const {
  std::vector<double> sorted;
  for (const auto& row : kept_) {
    if (std::isnan(row[column])) continue;
    sorted.push_back(mirrored ? inputs_[input].valid_min + inputs_[input].valid_max - row[column]
                              : row[column]);
  }
  if (sorted.empty()) return 0;
  std::ranges::sort(sorted);
  const Spread spread = known(inputs_[input]);
  double sum = 0;
  for (std::size_t k = 0; k < spread.share.size(); ++k) {
    const double place = spread.share[k] * static_cast<double>(sorted.size() - 1);
    sum += std::abs(sorted[static_cast<std::size_t>(std::lround(place))] - spread.reading[k]);
  }
  return sum / static_cast<double>(spread.share.size()) / spread.span();
}

bool RangeCount::mirrored(std::size_t input) const {
  const double before = distance(input, input);
  return inputs_[input].readings && inputs_[input].unit == "count" && before >= kFar &&
         kCloser * distance(input, input, true) <= before;
}

std::optional<std::pair<std::size_t, std::size_t>> RangeCount::exchanged() const {
  std::optional<std::pair<std::size_t, std::size_t>> best;
  double most_saved = 0;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    for (std::size_t j = i + 1; j < inputs_.size(); ++j) {
      const double before = distance(i, i) + distance(j, j);
      const double after = distance(i, j) + distance(j, i);
      if (before < 2 * kFar || kCloser * after > before || before - after <= most_saved) continue;
      most_saved = before - after;
      best = {i, j};
    }
  }
  return best;
}

}  // namespace flexor::model
