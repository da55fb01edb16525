#include "host/study/journal.hpp"

#include <gtest/gtest.h>

namespace flexor::study {
namespace {

constexpr const char* kRow =
    "1,raw,0,64.2,61.5,0.12,1.5,2,3,4,5,80,7,6,5,4,0,0,10.25,0,0,0,0.5,0,0,0.001,100,3";

bool is_row(const std::string& line) {
  TrialRow row;
  return parse_row(line, "1", "raw", 0, row);
}

std::string changed(const std::string& from, const std::string& to) {
  std::string line = kRow;
  return line.replace(line.find(from), from.size(), to);
}

TEST(TrialRow, ReadsBackToTheBit) {
  TrialRow row;
  ASSERT_TRUE(parse_row(kRow, "1", "raw", 0, row));
  EXPECT_EQ(text_of_row("1", "raw", 0, row), std::string(kRow) + "\n");
  EXPECT_FALSE(parse_row(kRow, "1", "raw", 1, row)) << "another trial";
}

TEST(TrialRow, ALagThatIsNoneIsTwoEmptyFields) {
  const std::string line = changed("61.5,0.12", ",");
  TrialRow row;
  row.lag_removed = score::LagRemoved{1, 2};
  ASSERT_TRUE(parse_row(line, "1", "raw", 0, row));
  EXPECT_FALSE(row.lag_removed);
  EXPECT_EQ(text_of_row("1", "raw", 0, row), line + "\n");
  EXPECT_FALSE(is_row(changed("61.5,0.12", "61.5,"))) << "one of the two";
  EXPECT_FALSE(is_row(changed("61.5,0.12", ",0.12"))) << "the other";
  EXPECT_TRUE(is_row(changed("61.5,0.12", "61.5,-0.12"))) << "of a hand that comes early";
}

TEST(TrialRow, WhatNoTrialWritesIsNoRow) {
  for (const char* value : {"nan", "inf", "-inf", "1e999", "", "-5", "1e308"}) {
    EXPECT_FALSE(is_row(changed("64.2", value))) << value;
    EXPECT_FALSE(is_row(changed("10.25", value))) << value;
  }
  EXPECT_FALSE(is_row(changed(",100,3", ",-100,3")));
  EXPECT_FALSE(is_row(changed(",100,3", ",100,-3")));
  EXPECT_FALSE(is_row(std::string(kRow) + ","));
  EXPECT_FALSE(is_row(std::string(kRow) + ",1"));
}

}  // namespace
}  // namespace flexor::study
