#include "host/study/twin_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "host/score/trial.hpp"
#include "host/study/log_rms.hpp"

namespace flexor::study {
namespace {

double cell(double ours_deg_s, double published_deg_s, std::size_t compensator) {
  static const auto deviation = published_standard_errors();
  const double z = std::log(ours_deg_s / published_deg_s) / deviation[compensator];
  return -z * z / 2;
}

}  // namespace

TableErrors published_table(int first, int last) {
  TableErrors out;
  for (int g = first; g <= last; ++g) {
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

double log_rms(const TableErrors& ours, const TableErrors& published) {
  LogRms out;
  for (std::size_t g = 0; g < ours.size(); ++g) {
    for (std::size_t c = 0; c < kPublishedCompensators; ++c) out.add(ours[g][c], published[g][c]);
  }
  return out.value();
}

double log_likelihood(const TableErrors& ours, const TableErrors& published) {
  double sum = 0;
  for (std::size_t g = 0; g < ours.size(); ++g) {
    for (std::size_t c = 0; c < kPublishedCompensators; ++c) sum += cell(ours[g][c], published[g][c], c);
  }
  return sum;
}

TwinTable::TwinTable(int first, int last, int trials, std::uint64_t seed) {
  plan_.motions = motions(fmt::format("{}-{}", first, last));
  for (const std::string& name : published_compensators()) {
    plan_.compensators.push_back(compensator(name, kPublishedRate_hz));
  }
  plan_.seed = seed;
  plan_.trials = trials;
}

double TwinTable::error(const Plan& plan, std::size_t gesture, std::size_t compensator) const {
  const twin::TrialInput input = first_input(plan, plan.motions[gesture], plan.compensators[compensator]);
  double sum = 0;
  for (int first = 0; first < plan.trials; first += twin::kTrialsAtOnce) {
    const int count = std::min(plan.trials - first, twin::kTrialsAtOnce);
    for (const twin::Trial& trial : twin::simulate(input, static_cast<std::uint64_t>(first), count)) {
      for (const double e :
           score::finger_errors(trial.glove_deg, trial.hand_deg, 1 / plan.parameters.camera_rate_hz))
        sum += e;
    }
  }
  return sum / plan.trials;
}

double TwinTable::log_likelihood(const twin::Parameters& parameters, const TableErrors& published,
                                 double floor) const {
  Plan plan = plan_;
  plan.parameters = parameters;
  double sum = 0;
  for (std::size_t c = 0; c < kPublishedCompensators; ++c) {  // Raw first: its averages are the surest
    for (std::size_t g = 0; g < published.size(); ++g) {
      sum += cell(error(plan, g, c), published[g][c], c);
      if (sum < floor) return -std::numeric_limits<double>::infinity();
    }
  }
  return sum;
}

TableErrors TwinTable::errors(const twin::Parameters& parameters, int threads) const {
  Plan plan = plan_;
  plan.parameters = parameters;
  TableErrors out(plan.motions.size());
  io::run_in_order<double>(
      0, out.size() * kPublishedCompensators, io::threads_of(threads),
      [&](std::size_t cell) {
        return error(plan, cell / kPublishedCompensators, cell % kPublishedCompensators);
      },
      [&](std::size_t cell, double mean_deg_s) {
        out[cell / kPublishedCompensators][cell % kPublishedCompensators] = mean_deg_s;
      });
  return out;
}

}  // namespace flexor::study
