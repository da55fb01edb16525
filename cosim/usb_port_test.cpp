#include "cosim/usb_port.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "host/io/terminal_test.hpp"

namespace flexor::cosim {
namespace {

class UsbPortTest : public testing::Test {
 protected:
  void SetUp() override { FLEXOR_NEEDS_TERMINALS(); }
};

int open_end(const UsbPort& port) { return ::open(port.name().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC); }

// As a board does, once a millisecond.
bool look(UsbPort& port) {
  bool opened = false;
  for (int k = 0; k < 3; ++k) opened = port.was_opened() || opened;
  return opened;
}

TEST_F(UsbPortTest, IsOpenUntilTheLastOfThoseWhoOpenedItAtOnceHasClosedIt) {
  UsbPort port;
  EXPECT_FALSE(look(port));
  EXPECT_FALSE(port.is_open());
  for (int round = 0; round < 3; ++round) {
    const int one = open_end(port);
    const int other = open_end(port);
    EXPECT_TRUE(look(port)) << round;
    EXPECT_TRUE(port.is_open());
    ::close(other);
    EXPECT_FALSE(look(port));
    EXPECT_TRUE(port.is_open());
    const int third = open_end(port);
    EXPECT_FALSE(look(port)) << "somebody has it open";
    ::close(third);
    ::close(one);
    EXPECT_FALSE(look(port));
    EXPECT_FALSE(port.is_open());
  }
}

TEST_F(UsbPortTest, AnOpeningRightAfterAClosingCounts) {
  UsbPort port;
  int end = open_end(port);
  EXPECT_TRUE(port.was_opened());
  for (int round = 0; round < 3; ++round) {
    ::close(end);
    end = open_end(port);
    EXPECT_TRUE(port.was_opened()) << round;
    EXPECT_FALSE(look(port));
  }
  ::close(end);
}

}  // namespace
}  // namespace flexor::cosim
