#include "host/io/serial.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/io/terminal_test.hpp"

namespace flexor::io {
namespace {

TEST(SerialPort, CarriesEveryByteBothWays) {
  FLEXOR_NEEDS_TERMINALS();
  Terminal board;
  SerialPort port(board.name(), 115200);
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  port.write(all);
  std::vector<std::uint8_t> came(all.size());
  for (std::size_t at = 0; at < came.size();) {
    const auto count = ::read(board.master(), came.data() + at, came.size() - at);
    ASSERT_GT(count, 0);
    at += static_cast<std::size_t>(count);
  }
  EXPECT_EQ(came, all);
  ASSERT_EQ(::write(board.master(), all.data(), all.size()), 256);
  came.clear();
  while (came.size() < all.size()) {
    const auto more = port.read(1);
    ASSERT_FALSE(more.empty());
    came.insert(came.end(), more.begin(), more.end());
  }
  EXPECT_EQ(came, all);
}

TEST(SerialPort, ReportsThatNothingComesAndThatThePortHasGone) {
  FLEXOR_NEEDS_TERMINALS();
  Terminal board;
  SerialPort port(board.name(), 9600);
  EXPECT_TRUE(port.read(0.02).empty());
  EXPECT_TRUE(port.read(0.02).empty()) << "and may be asked again";
  board.hang_up();
  EXPECT_THROW((void)port.read(1), JobError);
}

TEST(SerialPort, RefusesWhatIsNoPortInOneLine) {
  expect_refused([] { SerialPort port("/dev/no_such_port", 9600); }, "no such port: is the board");
  expect_refused([] { SerialPort port("/dev/null", 9600); }, "cannot be opened as a serial port");
}

}  // namespace
}  // namespace flexor::io
