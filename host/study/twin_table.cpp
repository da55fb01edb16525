#include "host/study/twin_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/score/trial.hpp"
#include "host/study/log_rms.hpp"

namespace flexor::study {
TableErrors published_table(int last) {
  TableErrors out;
  for (int g = 1; g <= last; ++g) {
    out.emplace_back();
    for (std::size_t c = 0; c < kPublishedCompensators; ++c) {
      out.back()[c] = *published_error_deg_s(g, published_compensators()[c]);
    }
  }
  return out;
}

std::array<double, kPublishedCompensators> published_standard_errors() {
  std::array<double, kPublishedCompensators> out{};
  constexpr auto kTrials = static_cast<double>(kPublishedTrials);
  for (std::size_t c = 0; c < kPublishedCompensators; ++c) {
    double sum = 0;
    for (int g = 1; g <= kLastFittedGesture; ++g) {
      const auto trials = published_trials_deg_s(g, published_compensators()[c]);
      const double mean = std::accumulate(trials.begin(), trials.end(), 0.0) / kTrials;
      double squares = 0;
      for (const double t : trials) squares += (t - mean) * (t - mean);
      sum += squares / (kTrials - 1) / kTrials / (mean * mean);
    }
    out[c] = std::sqrt(sum / kLastFittedGesture);
  }
  return out;
}

double log_likelihood(const TableErrors& ours, const TableErrors& published) {
  const auto deviation = published_standard_errors();
  double sum = 0;
  for (std::size_t g = 0; g < ours.size(); ++g) {
    for (std::size_t c = 0; c < kPublishedCompensators; ++c) {
      const double z = std::log(ours[g][c] / published[g][c]) / deviation[c];
      sum -= z * z / 2;
    }
  }
  return sum;
}

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
