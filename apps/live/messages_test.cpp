#include "apps/live/messages.hpp"

#include <gtest/gtest.h>

namespace flexor::live {
namespace {

TEST(Messages, RowsAreAsInTheDocument) {
  Rows rows(Kind::samples, 2);
  rows.add(1.5, std::vector{100.0, 101.0}, std::vector{0.0, 10.0});
  const auto bytes = rows.bytes();
  ASSERT_EQ(bytes.size(), 4U + 8 + 4 * 4);
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(bytes[1], 2);
  EXPECT_EQ(bytes[2], 1);
  EXPECT_EQ(bytes[3], 0);
  float second = 0;
  std::memcpy(&second, bytes.data() + 4 + 8 + 3 * 4, 4);
  EXPECT_EQ(second, 10.0F);
}

std::vector<std::uint8_t> picture(std::size_t size) {
  std::vector<std::uint8_t> out(16 + size);
  out[0] = 3;
  out[16] = 0xff;
  out[17] = 0xd8;
  const double t_s = 2.5;
  std::memcpy(out.data() + 8, &t_s, 8);
  return out;
}

TEST(Messages, APictureIsTakenWithItsTime) {
  const auto bytes = picture(100);
  const auto taken = picture_of(bytes);
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->t_s, 2.5);
  EXPECT_EQ(taken->jpeg.size(), 100U);
}

TEST(Messages, WhatIsNoPictureIsNone) {
  EXPECT_FALSE(picture_of({}));
  auto other = picture(100);
  other[0] = 1;
  EXPECT_FALSE(picture_of(other));
  other = picture(100);
  other[16] = 'P';
  EXPECT_FALSE(picture_of(other));
  EXPECT_FALSE(picture_of(picture(kLongestPicture + 1)));
  EXPECT_TRUE(picture_of(picture(kLongestPicture)));
  other = picture(100);
  const double never = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(other.data() + 8, &never, 8);
  EXPECT_FALSE(picture_of(other));
}

}  // namespace
}  // namespace flexor::live
