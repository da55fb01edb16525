#include "host/model/range_count.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace flexor::model {
namespace {

RangeCount counted(const std::vector<std::pair<double, double>>& ranges,
                   const std::vector<std::vector<double>>& rows) {
  Model model;
  for (const auto& [low, high] : ranges) model.inputs.push_back({"a", "", "", "", low, high});
  RangeCount count(model);
  for (const auto& row : rows) count.add(row);
  return count;
}

TEST(RangeCount, HalfOfTheReadingsOutsideIsMostlyOutsideAndLessIsNot) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto half = counted({{1, 10}}, {{1}, {10}, {10.5}, {0}, {kNan}}).counts().front();
  EXPECT_EQ(half.outside, 2u);
  EXPECT_EQ(half.readings, 4u);
  EXPECT_EQ(half.low, 0);
  EXPECT_EQ(half.high, 10.5);
  EXPECT_TRUE(half.mostly_outside());
  EXPECT_FALSE(counted({{1, 10}}, {{1}, {10}, {11}}).counts().front().mostly_outside());
  EXPECT_FALSE(counted({{1, 10}}, {}).counts().front().mostly_outside());
}

TEST(RangeCount, ExchangedColumnsAreFoundWhereThatExplainsWhatLiesOutside) {
  using Pair = std::optional<std::pair<std::size_t, std::size_t>>;
  EXPECT_EQ(counted({{1, 10}, {4, 6}, {20, 30}}, {{25, 5, 5}, {22, 5, 9}}).exchanged(), Pair({0, 2}));
  EXPECT_EQ(counted({{1, 10}, {20, 30}}, {{25, 25}, {22, 22}}).exchanged(), Pair()) << "one is still outside";
  EXPECT_EQ(counted({{1, 10}, {20, 30}}, {{5, 25}, {5, 25}}).exchanged(), Pair());
}

}  // namespace
}  // namespace flexor::model
