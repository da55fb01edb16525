// `flexor flash` of an ATmega32U4 through the protocol of its bootloader (AVR109, as Caterina.c of the Arduino core speaks
// it). What answers here is a stand-in on a pseudo-terminal, since simavr has no USB: no chip has run this.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "cosim/usb_helper_test.hpp"
#include "host/deploy/caterina.hpp"
#include "host/deploy/deploy.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/intel_hex.hpp"
#include "host/io/io.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;

// AVR109 as far as Caterina speaks it: addresses are of words, 128 bytes to a block.
class StandIn {
 public:
  explicit StandIn(std::array<std::uint8_t, 3> signature = {0x1e, 0x95, 0x87}) : signature_(signature) {
    terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    EXPECT_TRUE(terminal_ >= 0 && grantpt(terminal_) == 0 && unlockpt(terminal_) == 0);
    std::array<char, 64> name{};
    EXPECT_EQ(ptsname_r(terminal_, name.data(), name.size()), 0);
    port_ = name.data();
    kept_open_ = open(port_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    tcgetattr(kept_open_, &raw);
    cfmakeraw(&raw);
    tcsetattr(kept_open_, TCSANOW, &raw);
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  }
  ~StandIn() { finish(); }
  StandIn(const StandIn&) = delete;
  StandIn& operator=(const StandIn&) = delete;

  const std::string& port() const { return port_; }
  // At 1200 baud.
  bool touched() const {
    termios now{};
    return tcgetattr(kept_open_, &now) == 0 && cfgetospeed(&now) == B1200;
  }
  std::vector<std::uint8_t> finish() {
    if (thread_.joinable()) {
      thread_.request_stop();
      thread_.join();
      close(kept_open_);
      close(terminal_);
    }
    return flash_;
  }

 private:
  // A byte, or -1 once it is over.
  int next(const std::stop_token& stop) const {
    while (!stop.stop_requested()) {
      pollfd waiting{terminal_, POLLIN, 0};
      std::uint8_t byte = 0;
      if (poll(&waiting, 1, 20) > 0 && read(terminal_, &byte, 1) == 1) return byte;
    }
    return -1;
  }
  void say(const std::vector<std::uint8_t>& bytes) const {
    EXPECT_EQ(write(terminal_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  void say(const char* text) const { say(std::vector<std::uint8_t>(text, text + std::strlen(text))); }

  void serve(const std::stop_token& stop) {
    for (int command = next(stop); command >= 0; command = next(stop))
      answer(static_cast<char>(command), stop);
  }
  void answer(char command, const std::stop_token& stop) {
    switch (command) {
      case 'S':
        return say("CATERIN");
      case 'V':
        return say("10");
      case 'p':
        return say("S");
      case 'a':
        return say("Y");
      case 'b':
        return say({'Y', 0, kBlock});
      case 't':
        return say({0x44, 0});
      case 's':
        return say({signature_[2], signature_[1], signature_[0]});
      case 'A': {
        const int high = next(stop);
        at_ = 2 * static_cast<std::size_t>(256 * high + next(stop));
        return say("\r");
      }
      case 'B':
        return take_block(stop);
      case 'g':
        return give_block(stop);
      case 'T':
      case 'x':
      case 'y':
        (void)next(stop);
        return say("\r");
      case 'P':
      case 'L':
      case 'E':
        return say("\r");
      case 'F':
      case 'N':
      case 'Q':
      case 'r':
        return say({0xff});
      default:
        return say("?");
    }
  }
  std::size_t size_of_block(const std::stop_token& stop) const {
    const int high = next(stop);
    const int low = next(stop);
    EXPECT_EQ(next(stop), 'F');
    return static_cast<std::size_t>(256 * high + low);
  }
  void take_block(const std::stop_token& stop) {
    for (std::size_t left = size_of_block(stop); left > 0; --left) {
      const int byte = next(stop);
      if (at_ < flash_.size()) flash_[at_] = static_cast<std::uint8_t>(byte);
      ++at_;
    }
    say("\r");
  }
  void give_block(const std::stop_token& stop) {
    std::vector<std::uint8_t> out;
    for (std::size_t left = size_of_block(stop); left > 0; --left) out.push_back(flash_.at(at_++));
    say(out);
  }

  static constexpr std::uint8_t kBlock = 128;
  std::array<std::uint8_t, 3> signature_;
  std::vector<std::uint8_t> flash_ = std::vector<std::uint8_t>(32768, 0xff);
  std::size_t at_ = 0;
  int terminal_ = -1;
  int kept_open_ = -1;
  std::string port_;
  std::jthread thread_;
};

class Caterina : public testing::Test {
 protected:
  void SetUp() override {
    FLEXOR_NEEDS_TERMINALS();
    if (io::find_program("avrdude").empty())
      GTEST_SKIP() << "avrdude is not installed: script/bootstrap tests";
    folder_ = fs::path(testing::TempDir()) / ("flexor_caterina_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    deploy::Glove glove;
    glove.model = model::load(std::string(FLEXOR_SOURCE_DIR) + "/models/published_hw.json");
    glove.sensor.fill(deploy::divider(35, 25, 100.0 / 180));
    deploy::build_glove(glove, folder_ / "328p");
    glove.mcu = deploy::kAtmega32u4;
    deploy::build_glove(glove, folder_ / "32u4");
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  fs::path folder_;
};

TEST_F(Caterina, AnImageSaysWhichChipItIsFor) {
  EXPECT_STREQ(deploy::mcu_of(deploy::read_image(folder_ / "328p/glove.hex")).name, "atmega328p");
  EXPECT_STREQ(deploy::mcu_of(deploy::read_image(folder_ / "32u4/glove.hex")).name, "atmega32u4");
}

TEST_F(Caterina, AnAtmega32u4IsWrittenAndComparedThroughItsOwnProtocol) {
  StandIn board;
  const Finished r = flexor({"flash", folder_ / "32u4", "--port", board.port(), "--json"});
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_EQ(nlohmann::json::parse(r.out).at("target"), "atmega32u4");
  const deploy::FlashContent image = deploy::read_image(folder_ / "32u4/glove.hex");
  const std::vector<std::uint8_t> flash = board.finish();
  EXPECT_TRUE(std::equal(image.bytes.begin(), image.bytes.end(), flash.begin()));
}

TEST_F(Caterina, AnotherChipBehindTheSameProtocolIsNamedAndNotWritten) {
  StandIn board({0x1e, 0x94, 0x88});  // an ATmega16U4
  expect_says(flexor({"flash", folder_ / "32u4/glove.hex", "--port", board.port()}), 1,
              "the chip there is 0x1e9488");
  EXPECT_EQ(board.finish(), std::vector<std::uint8_t>(32768, 0xff));
}

// 57600 baud is an old bootloader's rate, too, but no Optiboot goes into this chip.
TEST_F(Caterina, ItsRateIsNotTakenForAnOldBootloaders) {
  StandIn board;
  const Finished r = flexor({"flash", folder_ / "32u4", "--port", board.port()});
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_NE(r.out.find("read back: the same"), std::string::npos) << r.out;
  EXPECT_EQ(r.out.find("old bootloader"), std::string::npos) << r.out;
}

// Either bootloader is silent to the other's protocol: nothing is written, and the line says whose image it is.
TEST_F(Caterina, AnImageOfTheOtherChipIsRefused) {
  const fs::path dump = folder_ / "flash.bin";
  build_optiboot("atmega328p", "0x7e00", "0x7ffe", folder_ / "boot.hex");
  {
    UsbHelper nano({option("bootloader", folder_ / "boot.hex"), option("flash", dump)});
    expect_says(flexor({"flash", folder_ / "32u4/glove.hex", "--port", nano.port()}), 1,
                "no bootloader of an ATmega32U4 answers, which the image is for");
    nano.finish();
  }
  EXPECT_EQ(io::read_file(dump).substr(0, 0x7e00), std::string(0x7e00, '\xff'));
  expect_says(flexor({"flash", folder_ / "32u4", "--target", "atmega328p", "--port", "/dev/null"}), 2,
              "is an image for an atmega32u4, not for an atmega328p: flexor deploy --target atmega328p");
  StandIn micro;
  expect_says(flexor({"flash", folder_ / "328p/glove.hex", "--port", micro.port()}), 1,
              "no bootloader answers");
  EXPECT_EQ(micro.finish(), std::vector<std::uint8_t>(32768, 0xff));
}

// A /dev of its own, in which stand-ins are plugged in.
class CaterinaPorts : public testing::Test {
 protected:
  void SetUp() override { FLEXOR_NEEDS_TERMINALS(); }
  CaterinaPorts()
      : dev_(fs::path(testing::TempDir()) / ("flexor_caterina_dev_" + std::to_string(::getpid()))) {
    fs::create_directories(dev_ / "serial/by-id");
  }
  ~CaterinaPorts() override { fs::remove_all(dev_); }

  void plug(const StandIn& board, const std::string& node, const std::string& id) const {
    fs::create_symlink(board.port(), dev_ / node);
    fs::create_symlink("../../" + node, dev_ / "serial/by-id" / id);
  }
  void unplug(const std::string& node, const std::string& id) const {
    fs::remove(dev_ / "serial/by-id" / id);
    fs::remove(dev_ / node);
  }
  // Long enough to be seen on a busy machine.
  static void a_moment() { std::this_thread::sleep_for(std::chrono::seconds(1)); }

  std::string found(const std::string& port, const std::function<void()>& on_say) const {
    const deploy::CaterinaPatience patience{2, 5, 5};
    const auto say = [&](const std::string& text) {
      EXPECT_NE(text.find("press the board's reset button, twice on a Pro Micro"), std::string::npos) << text;
      on_say();
    };
    return fs::canonical(deploy::caterina_port(port, say, dev_, patience)).string();
  }
  static void is_silent() { ADD_FAILURE() << "nothing is to be pressed"; }
  fs::path dev_;
};

TEST_F(CaterinaPorts, ABootloaderMayHaveTheNamesOfItsSketch) {
  StandIn board;
  plug(board, "ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
  const std::jthread user([&](const std::stop_token& stop) {
    while (!board.touched() && !stop.stop_requested())
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    unplug("ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
    a_moment();
    plug(board, "ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
  });
  EXPECT_EQ(found((dev_ / "ttyACM0").string(), is_silent), board.port());
}

TEST_F(CaterinaPorts, ANamedPortThatStaysIsTheBootloaders) {
  StandIn board;
  plug(board, "ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
  EXPECT_EQ(found((dev_ / "ttyACM0").string(), is_silent), board.port());
}

TEST_F(CaterinaPorts, WithAutoTheHandsBoardIsNotTakenForTheGlove) {
  StandIn hand;
  StandIn glove;
  plug(hand, "ttyUSB0", "usb-1a86_USB_Serial-if00");
  EXPECT_EQ(found("auto", [&] { plug(glove, "ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00"); }),
            glove.port());
  EXPECT_TRUE(hand.touched());
}

// Reset was pressed too early: the port that stayed is gone by and by, and comes back when it is pressed again.
TEST_F(CaterinaPorts, WithAutoABoardThatComesBackUnderItsNameIsTaken) {
  StandIn board;
  plug(board, "ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
  std::jthread user;
  const auto press = [&] {
    user = std::jthread([&] {
      unplug("ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
      a_moment();
      plug(board, "ttyACM0", "usb-Arduino_LLC_Arduino_Leonardo-if00");
    });
  };
  EXPECT_EQ(found("auto", press), board.port());
}

}  // namespace
}  // namespace flexor::cosim
