#include "host/identify/select.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "host/io/io.hpp"

namespace flexor::identify {

std::vector<Structure> auto_candidates(bool monotone) {
  std::vector<Structure> all = {make_structure(Family::linear), make_structure(Family::linear_dynamic, 1),
                                make_structure(Family::linear_dynamic, 2), make_dead_zone_structure(1)};
  for (const int knots : {6, 10}) {
    for (const int order : {1, 2}) {
      all.push_back(make_structure(Family::hammerstein, order, knots));
      all.push_back(make_structure(Family::hw, order, knots));
    }
  }
  all.push_back(make_structure(Family::hw, 3, 6));
  all.push_back(make_structure(Family::hw, 3, 10));
  all.push_back(make_structure(Family::wiener, 1, 8));
  all.push_back(make_structure(Family::wiener, 2, 8));
  all.push_back(make_structure(Family::hw_hysteresis, 1, 8, 1));
  all.push_back(make_structure(Family::hw_hysteresis, 2, 8, 2));
  for (Structure& s : all) s.monotone = monotone && (s.input_knots > 0 || s.output_knots > 0);
  return all;
}

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

double cross_validate(const Structure& structure, const Data& data,
                      const std::function<void()>& before_each) {
  double sum = 0;
  std::size_t count = 0;
  for (const Fold& fold : folds(structure, data, before_each)) {
    for (std::size_t k = fold.first; k <= fold.last; ++k) {
      if (!data.use[k]) continue;
      const auto at = static_cast<Eigen::Index>(k);
      const double error = data.angle_deg(at) - fold.summary.predicted_deg(at);
      sum += error * error;
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

Selection select(const std::vector<Structure>& candidates, const Data& data, const Progress& progress) {
  Selection selection;
  double best = std::numeric_limits<double>::infinity();
  for (const Structure& structure : candidates) {
    const std::size_t fits = kBlocks + 1;
    std::size_t done = fits * selection.candidates.size();
    const auto step = [&] {
      if (progress && !progress(done, fits * candidates.size(), describe(structure)))
        throw io::Cancelled("cancelled");
      ++done;
    };
    Candidate candidate;
    candidate.structure = structure;
    try {
      step();
      candidate.summary = fit(structure, data);
      candidate.cross_validated_deg = cross_validate(structure, data, step);
      best = std::min(best, candidate.cross_validated_deg);
    } catch (const io::JobError& error) {
      candidate.refusal = error.what();
    } catch (const io::Cancelled&) {
      if (!std::isfinite(best)) throw;
      selection.untried = candidates.size() - selection.candidates.size();
      break;
    }
    selection.candidates.push_back(std::move(candidate));
  }
  if (!std::isfinite(best)) throw io::JobError(selection.candidates.front().refusal);
  // Fewest parameters first; of as many, the better cross-validated.
  std::optional<std::pair<int, double>> least;
  for (std::size_t i = 0; i < selection.candidates.size(); ++i) {
    const Candidate& c = selection.candidates[i];
    if (!c.refusal.empty() || c.cross_validated_deg > (1 + kTolerance) * best) continue;
    const std::pair rank(c.summary.free_parameters, c.cross_validated_deg);
    if (least && rank >= *least) continue;
    least = rank;
    selection.chosen = i;
  }
  return selection;
}

}  // namespace flexor::identify
