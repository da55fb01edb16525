#include "host/deploy/flash.hpp"

#include <gtest/gtest.h>

#include "host/deploy/images.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/expect_test.hpp"
#include "host/io/serial.hpp"
#include "runtime/core/flash_map.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::expect_refused;

FlashContent parse(const std::string& text) { return parse_intel_hex(text, "x.hex", kOptibootBegin); }

TEST(IntelHex, IsReadAsItWasWritten) {
  FlashContent content{std::vector<std::uint8_t>(1000), 100};
  for (std::size_t i = 0; i < content.bytes.size(); ++i)
    content.bytes[i] = static_cast<std::uint8_t>(i < 100 ? 0xff : i * i);
  const FlashContent again = parse(to_intel_hex(content));
  EXPECT_EQ(again.begin, 100U);
  EXPECT_EQ(again.bytes, content.bytes);
}

// The example of Intel's specification (1988), with both kinds of base address.
TEST(IntelHex, IsAsTheSpecificationStates) {
  const std::string data = ":10010000214601360121470136007EFE09D2190140\n";
  EXPECT_EQ(parse(data + ":00000001FF\n").bytes[0x101], 0x46);
  EXPECT_EQ(parse(":020000020010EC\r\n" + data + ":00000001FF\r\n").begin, 0x200U);
  EXPECT_EQ(parse_intel_hex(":020000040001F9\n" + data + ":00000001FF", "x.hex", 0x20000).begin, 0x10100U);
}

TEST(IntelHex, WhatIsDamagedIsRefusedByLine) {
  const std::string data = ":10010000214601360121470136007EFE09D2190140\n";
  const std::string end = ":00000001FF\n";
  const std::vector<std::array<std::string, 2>> cases = {
      {data, "x.hex: is cut off"},
      {end, "holds no program"},
      {data + data + end, "line 2 writes address 0x100 a second time"},
      {data + end + data, "line 3 goes on after its end"},
      {":10010000214601360121470136007EFE09D2190141\n" + end, "line 1 has a wrong checksum"},
      {":107E0000214601360121470136007EFE09D21901C3\n" + end, "lies at 0x7e00"},
      {":0100\n" + end, "no Intel HEX"},
      {":020000000g00FE\n" + end, "no Intel HEX"},
      {"\177ELF\n", "no Intel HEX"},
      {":0300000000FE\n" + end, "has not the size"},
      {":00000009F7\n" + end, "unknown type 9"}};
  for (const auto& [text, why] : cases) expect_refused([&text = text] { parse(text); }, why);
}

class Ports : public testing::Test {
 protected:
  Ports() { fs::create_directories(dev_ / "serial/by-id"); }
  void add(const std::string& name) const { io::write_file(dev_ / name, "x"); }
  const io::TemporaryFolder temporary_;
  const fs::path dev_ = temporary_.path();
};

TEST_F(Ports, EachBoardIsFoundOnceByItsLastingName) {
  EXPECT_TRUE(io::serial_ports(dev_).empty());
  add("ttyUSB0");
  add("ttyACM3");
  add("ttyS0");
  fs::create_symlink("../../ttyUSB0", dev_ / "serial/by-id/usb-1a86_USB_Serial");
  EXPECT_EQ(io::serial_ports(dev_),
            (std::vector<std::string>{(dev_ / "serial/by-id/usb-1a86_USB_Serial").string(),
                                      (dev_ / "ttyACM3").string()}));
}

TEST_F(Ports, NoneSeveralAndWhatIsNoPortAreRefused) {
  expect_refused([&] { choose_port("auto", dev_); }, "no board found");
  expect_refused([&] { choose_port("/dev/no_such_port", dev_); }, "/dev/no_such_port: no such port");
  add("ttyUSB0");
  expect_refused([&] { choose_port("auto", dev_); }, "ttyUSB0: is no serial port");
  add("ttyUSB1");
  expect_refused([&] { choose_port("auto", dev_); }, "2 ports may be the board");
}

TEST_F(Ports, TheOnlyOneIsTaken) {
  fs::create_symlink("/dev/null", dev_ / "ttyUSB0");
  EXPECT_EQ(choose_port("auto", dev_), (dev_ / "ttyUSB0").string());
}

TEST_F(Ports, ImagesEndBelowTheBootloaderAndBeginAtZero) {
  io::write_file(dev_ / "late.hex", to_intel_hex({std::vector<std::uint8_t>(600, 1), 512}));
  expect_refused([&] { read_image(dev_ / "late.hex"); }, "begins at 0x200");
  io::write_file(dev_ / "long.hex", to_intel_hex({std::vector<std::uint8_t>(kOptibootBegin + 1, 1), 0}));
  expect_refused([&] { read_image(dev_ / "long.hex"); }, "lies at 0x7e00");
  io::write_file(dev_ / "fits.hex", to_intel_hex({std::vector<std::uint8_t>(kOptibootBegin, 1), 0}));
  EXPECT_EQ(read_image(dev_ / "fits.hex").bytes.size(), kOptibootBegin);
}

TEST(KeyRecords, AreReadAndReplacedInTheirPage) {
  const link::Key key = key_from_hex("000102030405060708090a0b0c0d0e0f");
  const FlashContent page = page_with_key(key);
  EXPECT_EQ(page.begin, core::kKeyBegin);
  EXPECT_EQ(page.bytes.size(), core::kKeyBegin + core::kFlashPage);
  EXPECT_EQ(to_hex(*key_in(page, "x")), to_hex(key));
  EXPECT_FALSE(key_in(page_with_key({}), "x").has_value()) << "zeros are no key";
  expect_refused([&] { key_in({std::vector<std::uint8_t>(32768, 0xff), 0}, "x"); }, "x: holds no key record");
  // Whichever bit falls over.
  for (std::size_t bit = 64; bit < 8 * 26; ++bit) {
    FlashContent damaged = page;
    std::uint8_t& byte = damaged.bytes[core::kKeyBegin + bit / 8];
    byte = static_cast<std::uint8_t>(byte ^ 1U << bit % 8);
    expect_refused([&] { key_in(damaged, "x"); }, "is damaged");
  }
}

}  // namespace
}  // namespace flexor::deploy
