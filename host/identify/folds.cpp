#include "host/identify/folds.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::identify {

std::vector<Fold> folds(const Structure& structure, const Data& data,
                        const std::function<void()>& before_each) {
  std::vector<std::size_t> used;
  for (std::size_t k = 0; k < data.use.size(); ++k) {
    if (data.use[k]) used.push_back(k);
  }
  const auto guard = static_cast<std::size_t>(std::lround(kGuard_s / data.period_s));
  std::vector<Fold> all;
  for (std::size_t block = 0; block < kBlocks; ++block) {
    Fold fold{used[used.size() * block / kBlocks], used[used.size() * (block + 1) / kBlocks - 1], {}};
    Data rest = data;
    const std::size_t end = std::min(fold.last + guard + 1, rest.use.size());
    for (std::size_t k = fold.first - std::min(fold.first, guard); k < end; ++k) rest.use[k] = 0;
    if (before_each) before_each();
    fold.summary = fit(structure, rest);
    all.push_back(std::move(fold));
  }
  return all;
}

}  // namespace flexor::identify
