#include "host/camera/container.hpp"

#include <gtest/gtest.h>

#include "host/camera/test_pictures.hpp"
#include "host/camera/video.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
namespace {
namespace fs = std::filesystem;

class Container : public testing::TestWithParam<const char*> {};

// A file that ends anywhere else than at its end is not whole, and neither is one whose end was written
// without the sizes that are filled in last.
TEST_P(Container, IsWholeOnlyWithItsLastByte) {
  const fs::path path = scratch(std::string("whole") + GetParam());
  VideoWriter video(path, 64, 48, 30);
  for (int i = 0; i < 10; ++i) video.add(dots(64, 48, kWall, {{{20.0 + i, 20.0}}}));
  video.finish();
  EXPECT_TRUE(is_whole(path));
  const std::string bytes = io::read_file(path);
  for (std::size_t length = bytes.size() - 1; length > bytes.size() / 300; length -= 1 + bytes.size() / 300) {
    fs::resize_file(path, length);
    ASSERT_FALSE(is_whole(path)) << length << " of " << bytes.size();
  }
  io::write_file(path, bytes + "x");
  EXPECT_FALSE(is_whole(path));
  fs::remove(path);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Container, testing::Values(".mp4", ".avi", ".mkv"));

}  // namespace
}  // namespace flexor::camera
