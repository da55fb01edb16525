#include "host/study/twin_table.hpp"

#include <gtest/gtest.h>

#include "host/study/log_rms.hpp"
#include "host/study/trials.hpp"

namespace flexor::study {
namespace {

TEST(TwinTable, TheShippedParametersAreAsNearThePublishedAveragesAsStated) {
  EXPECT_NEAR(log_rms(TwinTable(1, 4, 16, 7).errors(twin::Parameters(), 2), published_table(1, 4)), 0.271,
              0.01);
}

TEST(TwinTable, IsWhatTheExperimentPrints) {
  Plan p;
  p.motions = motions("1-2");
  p.compensators = compensators({"raw", "published-w", "published-hw"}, 10);
  p.seed = 7;
  p.trials = 20;
  const Result r = run(p, {});
  const TwinTable table(1, 2, 20, 7);
  const TableErrors ours = table.errors(p.parameters, 2);
  for (std::size_t g = 0; g < 2; ++g) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(ours[g][c], r.cell(g, c).total_deg_s.mean(), 1e-9);
  }
  const TableErrors published = published_table(1, 2);
  const double whole = log_likelihood(ours, published);
  EXPECT_NEAR(table.log_likelihood(p.parameters, published, whole - 1), whole, 1e-9);
  EXPECT_TRUE(std::isinf(table.log_likelihood(p.parameters, published, whole + 1e-6)));
}

TEST(TwinTable, ItsStandardErrorsAreThoseOfThePublishedTrials) {
  const auto s = published_standard_errors();
  EXPECT_NEAR(s[0], 0.277, 0.001);
  EXPECT_NEAR(s[1], 0.494, 0.001);
  EXPECT_NEAR(s[2], 0.619, 0.001);
}

}  // namespace
}  // namespace flexor::study
