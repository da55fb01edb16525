#include "host/identify/select.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/io/io.hpp"

namespace flexor::identify {
namespace {

Data simulate(bool curved) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise;
  Data data;
  data.channel = "thumb";
  data.period_s = 0.05;
  data.input.resize(2000);
  data.angle_deg.resize(2000);
  data.use.assign(2000, 1);
  for (int k = 0; k < 2000; ++k) {
    const double u = 500 + 200 * std::sin(0.05 * k) + 150 * std::sin(0.013 * k);
    data.input(k) = u;
    data.angle_deg(k) = (curved ? 1e-4 * u * u : 0.1 * u) + 0.3 * noise(random);
  }
  return data;
}

TEST(Select, TakesTheStraightLineWhereTheTruthIsOne) {
  const std::vector<Structure> candidates = {make_structure(Family::linear),
                                             make_structure(Family::hammerstein, 1, 6),
                                             make_structure(Family::hw, 2, 10)};
  const Selection s = select(candidates, simulate(false), {});
  EXPECT_EQ(s.chosen, 0u);
  for (const Candidate& c : s.candidates) {
    EXPECT_NEAR(c.cross_validated_deg, 0.3, 0.05);
    EXPECT_GE(c.cross_validated_deg, 0.98 * c.summary.rmse_deg);
  }
}

TEST(Select, TakesTheCurveWhereTheTruthIsCurved) {
  const std::vector<Structure> candidates = {make_structure(Family::linear),
                                             make_structure(Family::hammerstein, 1, 6)};
  std::size_t called = 0;
  const Selection s =
      select(candidates, simulate(true), [&](std::size_t done, std::size_t of, const std::string&) {
        EXPECT_EQ(done, called++);
        EXPECT_EQ(of, 10u);  // each of the two: all of the data, and without each of four blocks
        return true;
      });
  EXPECT_EQ(s.chosen, 1u);
  EXPECT_EQ(called, 10u);
}

TEST(Select, ACandidateThatCannotBeFittedIsShownWithItsReason) {
  Data data = simulate(true);
  std::fill(data.use.begin() + 110, data.use.end(), 0);
  const Selection s = select({make_structure(Family::linear), make_structure(Family::hw, 3, 16)}, data, {});
  EXPECT_EQ(s.chosen, 0u);
  EXPECT_NE(s.candidates[1].refusal.find("too few"), std::string::npos);
}

TEST(Select, NothingFittedIsAnError) {
  Data data = simulate(true);
  data.input.setConstant(1);
  EXPECT_THROW((void)select({make_structure(Family::linear)}, data, {}), io::JobError);
}

TEST(Select, AutoComparesEveryFamily) {
  for (const Family family : families()) {
    EXPECT_TRUE(std::ranges::any_of(auto_candidates(false), [&](const Structure& s) {
      return s.family == family;
    })) << name(family);
  }
}

}  // namespace
}  // namespace flexor::identify
