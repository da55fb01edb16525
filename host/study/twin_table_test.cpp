#include "host/study/twin_table.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
  const TableErrors published = published_table(4);
  LogRms distance;
  for (std::size_t g = 0; g < 4; ++g) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(ours[g][c], r.cell(g, c).total_deg_s.mean(), 1e-9);
      distance.add(ours[g][c], published[g][c]);
    }
  }
  EXPECT_NEAR(distance.value(), 0.271, 0.01) << "the shipped parameters, as stated";
}

TEST(TwinTable, ACellCountsByItsStandardError) {
  const TableErrors published = published_table(2);
  TableErrors ours = published;
  EXPECT_DOUBLE_EQ(log_likelihood(ours, published), 0);
  ours[1][2] *= std::exp(2 * published_standard_errors()[2]);
  EXPECT_NEAR(log_likelihood(ours, published), -2, 1e-9);
}

TEST(TwinTable, ItsStandardErrorsAreThoseOfThePublishedTrials) {
  const auto s = published_standard_errors();
  EXPECT_NEAR(s[0], 0.277, 0.001);
  EXPECT_NEAR(s[1], 0.494, 0.001);
  EXPECT_NEAR(s[2], 0.619, 0.001);
}

}  // namespace
}  // namespace flexor::study
