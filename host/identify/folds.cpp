#include "host/identify/folds.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::identify {
namespace {

using Eigen::Index;

constexpr std::size_t kFolds = 6;
constexpr std::size_t kMostFolds = 8;  // where whole recordings are left out
constexpr double kGuard_s = 1;

}  // namespace

std::vector<Fold> folds_of(const std::vector<Index>& used, const std::vector<Index>& begin, double period_s) {
  const auto place = [&](Index sample) {
    return static_cast<std::size_t>(std::ranges::lower_bound(used, sample) - used.begin());
  };
  const std::size_t n = begin.size() - 1;
  std::vector<Fold> out(n > 2 ? std::min(n, kMostFolds) : kFolds);
  const auto add = [&](Fold& fold, std::size_t from, std::size_t to) {
    const auto guard = std::min(std::lround(kGuard_s / period_s), static_cast<long>(to - from) / 4);
    if (from < to) fold.push_back({used[from], used[to - 1], guard});
  };
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (n > 2) {
      add(out[f], place(begin[f * n / out.size()]), place(begin[(f + 1) * n / out.size()]));
      continue;
    }
    for (std::size_t s = 0; s < n; ++s) {
      const std::size_t from = place(begin[s]);
      const std::size_t size = place(begin[s + 1]) - from;
      add(out[f], from + size * f / out.size(), from + size * (f + 1) / out.size());
    }
  }
  std::erase_if(out,
                [](const Fold& fold) { return fold.empty(); });  // of a recording without a usable sample
  return out;
}

std::vector<Summary> fit_folds(const Structure& structure, const Data& data, const std::vector<Fold>& folds,
                               const ChainOptions& options) {
  std::vector<Summary> out;
  for (const Fold& fold : folds) {
    Data rest = data;
    for (const Block& block : fold) {
      const Index end = std::min(block.last + block.guard + 1, data.size());
      for (Index k = std::max<Index>(block.first - block.guard, 0); k < end; ++k)
        for (Index copy = k; copy < rest.weight.size(); copy += data.size()) rest.weight(copy) = 0;
    }
    out.push_back(fit(structure, rest, options));
  }
  return out;
}

}  // namespace flexor::identify
