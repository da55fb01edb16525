// Cross-validation: which samples are left out together, the same for every candidate.
//
// Blocks of samples in time, six of each recording, of two recordings the same parts, since they may be one motion; whole recordings
// where there are more than two. Beside each block a guard of a second, a quarter of the block at most, is not fitted either.
#pragma once

#include <vector>

#include "host/identify/fit.hpp"

namespace flexor::identify {

// Samples of one recording, both ends included, and how many on either side are not fitted.
struct Block {
  Eigen::Index first;
  Eigen::Index last;
  Eigen::Index guard;
};
using Fold = std::vector<Block>;

// `used`: the samples whose error counts, ascending; `begin`: the first sample of each recording, and the end.
std::vector<Fold> folds_of(const std::vector<Eigen::Index>& used, const std::vector<Eigen::Index>& begin,
                           double period_s);

// A chain's fits to all but each fold: what `options` does not give (knots, a start, the width of the loss) comes from that part
// alone, as the parameters do. Throws io::JobError when one cannot be fitted.
std::vector<Summary> fit_folds(const Structure& structure, const Data& data, const std::vector<Fold>& folds,
                               const ChainOptions& options);

}  // namespace flexor::identify
