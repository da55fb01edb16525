// Blocked cross-validation of a chain: the used samples are cut into contiguous blocks of equal length; each is left out once,
// with a guard of one second on either side, the structure fitted to the rest, knots and starting points included, and the
// block predicted.
#pragma once

#include <functional>
#include <vector>

#include "host/identify/fit.hpp"

namespace flexor::identify {

inline constexpr int kBlocks = 4;
inline constexpr double kGuard_s = 1.0;

// One block left out: the fit to the rest, and which samples it never saw.
struct Fold {
  std::size_t first = 0;  // of the block's samples, both ends included
  std::size_t last = 0;
  Summary summary;
};

// Each fold takes knots, starting points and parameters from its own training part alone. Throws io::JobError
// when a block's complement cannot be fitted. `before_each` fit may throw.
std::vector<Fold> folds(const Structure& structure, const Data& data,
                        const std::function<void()>& before_each = {});

}  // namespace flexor::identify
