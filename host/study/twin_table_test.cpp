#include "host/study/twin_table.hpp"

#include <gtest/gtest.h>

#include "host/study/log_rms.hpp"
#include "host/study/trials.hpp"

namespace flexor::study {
namespace {

TEST(TwinTable, IsWhatTheExperimentPrints) {
  Plan p;
  p.motions = motions("1-4");
  p.compensators = compensators(published_compensators(), kPublishedRate_hz);
  p.seed = 7;
  p.trials = 20;
  const Result r = run(p, {});
  const TableErrors ours = twin_table(p.parameters, 4, 20, 7);
  LogRms distance;
  for (std::size_t g = 0; g < 4; ++g) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(ours[g][c], r.cell(g, c).total_deg_s.mean(), 1e-9);
      distance.add(ours[g][c], *published_error_deg_s(static_cast<int>(g) + 1, published_compensators()[c]));
    }
  }
  EXPECT_NEAR(distance.value(), 0.271, 0.01) << "the shipped parameters, as stated";
}

}  // namespace
}  // namespace flexor::study
