#include "host/identify/window.hpp"

#include <gtest/gtest.h>

namespace flexor::identify {
namespace {

TEST(Turns, CountOnlyWhatGoesFarEnoughBothWays) {
  const std::vector<double> twice = {0, 5, 10, 6, 1, 0, 4, 9, 3};
  EXPECT_EQ(turns_of(twice, 5).count(), 3);
  EXPECT_EQ(turns_of(twice, 5).high, (std::vector<double>{10, 9}));
  EXPECT_EQ(turns_of(twice, 5).low, (std::vector<double>{0}));
  EXPECT_EQ(turns_of(twice, 11).count(), 0);
  EXPECT_EQ(turns_of(std::vector<double>{0, 10}, 5).count(), 0) << "it went one way only";
}

TEST(Turns, KnowWhereTheFirstWayBeganAndTheLastOneEnded) {
  const Turns turns = turns_of(std::vector<double>{1, 5, 10, 6, 2, 0, 4, 9}, 5);
  EXPECT_EQ(turns.low_ends, (std::vector<double>{1, 0}));
  EXPECT_EQ(turns.high_ends, (std::vector<double>{10, 9}));
  EXPECT_EQ(turns.there_and_back, 9);
  EXPECT_EQ(turns_of(std::vector<double>{0, 10}, 5).there_and_back, 0);
}

TEST(Quantile, LiesStraightBetweenReadings) {
  const std::vector<double> sorted = {0, 10, 20, 30, 40};
  EXPECT_DOUBLE_EQ(quantile_of(sorted, 0), 0);
  EXPECT_DOUBLE_EQ(quantile_of(sorted, 0.625), 25);
  EXPECT_DOUBLE_EQ(quantile_of(sorted, 1), 40);
}

}  // namespace
}  // namespace flexor::identify
