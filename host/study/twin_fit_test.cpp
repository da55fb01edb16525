#include "host/study/twin_fit.hpp"

#include <gtest/gtest.h>
#include <sched.h>

namespace flexor::study {
namespace {

// The whole process on one processor for the time being.
class OneProcessor {
 public:
  OneProcessor() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu) {
      if (CPU_ISSET(cpu, &before_)) CPU_SET(cpu, &one);
    }
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OneProcessor() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_{};
};

TEST(TwinFigures, TheSearchGivesTheSameBytesAgainAndOnOneProcessor) {
  const auto search = [] {
    return twin::to_json(calibrate_twin(twin::Parameters(), 30, 16, 7, {}).parameters);
  };
  const std::string first = search();
  EXPECT_EQ(search(), first);
  const OneProcessor one;
  EXPECT_EQ(search(), first);
}

// A short search is already about as near to the published table as the shipped configuration.
TEST(TwinFigures, TheSearchEndsWhereTheShippedConfigurationIs) {
  const double shipped = log_rms(TwinTable(1, 4, 16, 7).errors(twin::Parameters(), 2), published_table(1, 4));
  EXPECT_GT(shipped, 0.2);
  EXPECT_LT(shipped, 0.3);
  EXPECT_NEAR(calibrate_twin(twin::Parameters(), 220, 16, 7, {}).log_rms, shipped, 0.02);
}

TEST(TwinFigures, TheSearchImprovesOnItsStart) {
  const TwinFit start = calibrate_twin(twin::Parameters(), 1, 16, 7, {});
  const TwinFit fit = calibrate_twin(twin::Parameters(), 150, 16, 7, {});
  EXPECT_LT(fit.cost, 0.8 * start.cost);
  EXPECT_EQ(free_parameters().size(), 16U);
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
