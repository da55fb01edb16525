// Chooses a structure with data from the fitted part only.
//
// Blocked cross-validation: the used samples are cut into contiguous blocks of equal length; each is left out
// once, with a guard of one second on either side, the structure fitted to the rest, knots and starting
// points included, and the block predicted. The figure is the RMSE over all blocks together. The structure
// with the fewest parameters within 2 % of the best wins.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/identify/fit.hpp"

namespace flexor::identify {

inline constexpr int kBlocks = 4;
inline constexpr double kGuard_s = 1.0;
inline constexpr double kTolerance = 0.02;

struct Candidate {
  Structure structure;
  Summary summary;                 // fit to the whole fitted part
  double cross_validated_deg = 0;  // RMSE
  std::string refusal;             // why it could not be fitted; the other fields are then empty
};

struct Selection {
  std::vector<Candidate> candidates;
  std::size_t chosen = 0;
  std::size_t untried = 0;  // after a stop
};

// Called before each fit: how many are done, of how many, the structure's description. False: no further one is
// done; io::Cancelled is thrown where none was.
using Progress = std::function<bool(std::size_t done, std::size_t of, const std::string& what)>;

inline constexpr const char* kStopped = "stopped before all structures were tried: the best so far is taken";

// The structures that auto compares: all families, with several numbers of knots and poles.
std::vector<Structure> auto_candidates(bool monotone);

// Throws io::JobError when no candidate could be fitted, with the first one's reason; io::Cancelled.
Selection select(const std::vector<Structure>& candidates, const Data& data, const Progress& progress);

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

// RMSE over the blocks that the folds left out.
double cross_validate(const Structure& structure, const Data& data,
                      const std::function<void()>& before_each = {});

}  // namespace flexor::identify
