#include "host/io/serial.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <string>

#include "host/io/io.hpp"
#include "host/io/terminal_test.hpp"

namespace flexor::io {
namespace {

// A pseudo-terminal: what is written to one end comes out of the other.
class SerialPortTest : public testing::Test {
 protected:
  void SetUp() override {
    FLEXOR_NEEDS_TERMINALS();
    board_ = ::posix_openpt(O_RDWR | O_NOCTTY);
    ::grantpt(board_);
    ::unlockpt(board_);
    path_ = ::ptsname(board_);
  }
  ~SerialPortTest() override { unplug(); }
  void unplug() {
    if (board_ >= 0) ::close(board_);
    board_ = -1;
  }
  int board_ = -1;
  std::string path_;
};

TEST_F(SerialPortTest, CarriesEveryByteBothWays) {
  SerialPort port(path_, 115200);
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  port.write(all);
  std::vector<std::uint8_t> came(all.size());
  for (std::size_t at = 0; at < came.size();) {
    const auto count = ::read(board_, came.data() + at, came.size() - at);
    ASSERT_GT(count, 0);
    at += static_cast<std::size_t>(count);
  }
  EXPECT_EQ(came, all);
  ASSERT_EQ(::write(board_, all.data(), all.size()), 256);
  came.clear();
  while (came.size() < all.size()) {
    const auto more = port.read(1);
    ASSERT_FALSE(more.empty());
    came.insert(came.end(), more.begin(), more.end());
  }
  EXPECT_EQ(came, all);
}

TEST_F(SerialPortTest, SaysThatNothingComesAndThatThePortHasGone) {
  SerialPort port(path_, 9600);
  EXPECT_TRUE(port.read(0.02).empty());
  EXPECT_TRUE(port.read(0.02).empty()) << "and may be asked again";
  unplug();
  EXPECT_THROW((void)port.read(1), JobError);
}

TEST(SerialPort, RefusesWhatIsNoPortInOneLine) {
  const auto says = [](const std::string& path) {
    try {
      SerialPort port(path, 9600);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(says("/dev/no_such_port").find("is the board plugged in?"), std::string::npos);
  EXPECT_NE(says("/dev/null").find("cannot be opened as a serial port"), std::string::npos);
}

}  // namespace
}  // namespace flexor::io
