#include "host/camera/jpeg.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "host/io/expect_test.hpp"

namespace flexor::camera {
namespace {

Picture slope(int width, int height) {
  Picture out(height, width, CV_8UC3);
  for (int x = 0; x < width; ++x) out.col(x) = cv::Scalar::all(x * 200 / width);
  return out;
}

void expect_fault(std::string_view bytes, const std::string& reason) {
  io::expect_refused([&] { from_jpeg(bytes); }, reason);
}

TEST(Jpeg, APictureComesBack) {
  const Picture picture = slope(320, 200);
  const std::string bytes = to_jpeg(picture);
  EXPECT_LT(bytes.size(), 3 * picture.total() / 10);
  const Picture back = from_jpeg(bytes);
  ASSERT_EQ(back.cols, 320);
  ASSERT_EQ(back.rows, 200);
  EXPECT_LT(cv::norm(back, picture, cv::NORM_INF), 12);
}

TEST(Jpeg, WhatIsNoPictureOrOutOfBoundsIsRefused) {
  const std::string good = to_jpeg(slope(64, 64));
  EXPECT_NO_THROW(from_jpeg(good));
  expect_fault("", "no JPEG");
  expect_fault("hello", "no JPEG");
  expect_fault(std::string(10000, '\xff'), "no JPEG");
  expect_fault(good.substr(0, 20), "cut off");
  expect_fault(good + std::string(kMostJpegBytes, '\0'), "at most 2097152");
  expect_fault(to_jpeg(slope(63, 64)), "each side must have 64 to 4096");
  expect_fault(to_jpeg(slope(64, 4097)), "each side must have 64 to 4096");
}

// The size is what the header states: nothing of it is allocated before it was looked at.
TEST(Jpeg, AStatedSizeAloneAllocatesNothing) {
  std::string huge = to_jpeg(slope(64, 64));
  const std::size_t at = huge.find("\xff\xc0");
  ASSERT_NE(at, std::string::npos);
  for (std::size_t i = 5; i < 9; ++i) huge[at + i] = '\xff';
  expect_fault(huge, "65535 x 65535");
  // A second size behind a good first one.
  std::string twice = to_jpeg(slope(64, 64));
  twice.insert(at, huge.substr(at, 2 + 17));
  expect_fault(twice, "twice");
}

TEST(Jpeg, AProgressiveOneIsRefused) {
  const Picture picture = slope(64, 64);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  expect_fault({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "progressive");
}

TEST(Jpeg, TheOrientationThatAPhoneNotesIsLeftAlone) {
  std::string bytes = to_jpeg(slope(128, 64));
  const std::string turned(
      "\xff\xe1\x00\x22"
      "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0",
      36);
  bytes.insert(2, turned);
  EXPECT_EQ(from_jpeg(bytes).cols, 128);
}

}  // namespace
}  // namespace flexor::camera
