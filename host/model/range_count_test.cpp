#include "host/model/range_count.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "host/model/standard_error.hpp"

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

TEST(RangeCount, ExchangedColumnsAreFoundWhereTheirReadingsLieWhereTheOthersLay) {
  using Pair = std::optional<std::pair<std::size_t, std::size_t>>;
  EXPECT_EQ(counted({{1, 10}, {4, 6}, {20, 30}}, {{28, 5, 2}, {22, 5, 9}}).exchanged(), Pair({0, 2}));
  EXPECT_EQ(counted({{1, 10}, {20, 30}}, {{25, 25}, {22, 22}}).exchanged(), Pair()) << "one is still outside";
  EXPECT_EQ(counted({{1, 10}, {20, 30}}, {{5, 25}, {5, 25}}).exchanged(), Pair());
}

// Of two sensors of the same valid range.
TEST(RangeCount, WhatTheModelWasMadeFromTellsReadingsThatAreWithinTheValidRange) {
  Model model;
  model.inputs = {{"a", "", "", "", 1, 1022}, {"b", "", "", "", 1, 1022}};
  model.inputs[0].readings = Spread{{0, 0.5, 1}, {200, 400, 600}};
  model.inputs[1].readings = Spread{{0, 0.5, 1}, {500, 600, 700}};
  const auto read = [&](auto&& at) {
    RangeCount count(model);
    for (int k = 0; k <= 5000; ++k) count.add(at(k / 5000.0));
    return count;
  };
  using Row = std::vector<double>;
  const auto fine = read([](double x) { return Row{250 + 400 * x, 530 + 200 * x}; });
  EXPECT_FALSE(fine.exchanged()) << "both a seventh off";
  EXPECT_FALSE(fine.counts()[1].mostly_beyond());
  EXPECT_TRUE(read([](double x) { return Row{500 + 200 * x, 200 + 400 * x}; }).exchanged());
  const auto eight_bits = read([](double x) { return Row{50 + 100 * x, 125 + 50 * x}; });
  EXPECT_TRUE(eight_bits.counts()[0].mostly_beyond());
  EXPECT_FALSE(eight_bits.exchanged());
}

TEST(RangeCount, ADividerTheOtherWayRoundIsFoundThoughAllReadingsAreWithinTheRange) {
  Model model;
  model.inputs = {{"a", "", "count", "", 1, 1022}};
  model.inputs[0].readings = Spread{{0.02, 0.5, 0.98}, {346, 484, 612}};
  const auto mirrored = [&](double gain, double offset) {
    RangeCount count(model);
    for (int k = 0; k <= 100; ++k) count.add(std::vector{offset + gain * (340 + 2.8 * k)});
    return count.mirrored(0);
  };
  EXPECT_TRUE(mirrored(-1, 1023));
  EXPECT_FALSE(mirrored(1, 0));
  EXPECT_FALSE(mirrored(1, 40)) << "put on again";
}

TEST(StandardErrors, GrowBeyondTheReadingsThatWereSeen) {
  Model model;
  model.inputs = {{"bend", "", "", "", 0, 1000}};
  model.inputs[0].readings = Spread{{0, 1}, {100, 300}};
  model.blocks = {{{"bend"}, "index angle", Saturation{0, 90}}};
  model.joints = {{"index", "index angle", 0, Accuracy{{10, 60}, {3, 3}}}};
  const StandardErrors errors(model);
  EXPECT_EQ(errors.of(0, 30, std::vector{200.}), 3);
  EXPECT_EQ(errors.of(0, 60, std::vector{316.}), 5);  // 4 degrees further, 0.25 degrees a count
  EXPECT_EQ(errors.of(0, 60, std::vector{std::numeric_limits<double>::quiet_NaN()}), 3);
}

}  // namespace
}  // namespace flexor::model
