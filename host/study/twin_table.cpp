#include "host/study/twin_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/score/trial.hpp"

namespace flexor::study {

TableErrors twin_table(const twin::Parameters& parameters, int last, int trials, std::uint64_t seed) {
  Plan plan;
  plan.parameters = parameters;
  plan.motions = motions(fmt::format("1-{}", last));
  plan.compensators = compensators(published_compensators(), kPublishedRate_hz);
  plan.seed = seed;
  plan.trials = trials;
  TableErrors out(plan.motions.size());
  for (std::size_t g = 0; g < out.size(); ++g) {
    for (std::size_t c = 0; c < kPublishedCompensators; ++c) {
      const twin::TrialInput input = first_input(plan, plan.motions[g], plan.compensators[c]);
      double sum_deg_s = 0;
      for (int first = 0; first < trials; first += twin::kTrialsAtOnce) {
        const int count = std::min(trials - first, twin::kTrialsAtOnce);
        for (const twin::Trial& trial : twin::simulate(input, static_cast<std::uint64_t>(first), count)) {
          for (const double error_deg_s :
               score::finger_errors(trial.glove_deg, trial.hand_deg, 1 / parameters.camera_rate_hz))
            sum_deg_s += error_deg_s;
        }
      }
      out[g][c] = sum_deg_s / trials;
    }
  }
  return out;
}

}  // namespace flexor::study
