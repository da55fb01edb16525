// For tests of what flashes boards, and of what speaks with the program behind the bootloader: a board as a PC sees it, on
// a pseudo-terminal in real time. Opening the port resets the board, as the capacitor at DTR does.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cosim/board.hpp"
#include "cosim/flexor_test.hpp"
#include "cosim/usb_port.hpp"
#include "host/deploy/hardware.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "host/study/bench.hpp"

namespace flexor::cosim {

inline const std::filesystem::path kBootloaders = "/usr/share/arduino/hardware/arduino/avr/bootloaders";
inline const std::filesystem::path kOldBootloader = study::kBootloader;

// Optiboot at 115200 baud, built from the package's source without the LED's three flashes, which this compiler does not get into the 512
// bytes that are there.
inline void build_optiboot(const std::string& mcu, const std::string& begin, const std::string& version,
                           const std::filesystem::path& hex) {
  const std::string source = kBootloaders / "optiboot";
  const std::string elf = hex.string() + ".elf";
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{
            "avr-gcc", "-Os", "-fno-inline-small-functions", "-fno-split-wide-types", "-mshort-calls",
            "-mmcu=" + mcu, "-w", "-DF_CPU=16000000L", "-DLED_START_FLASHES=0", "-DBAUD_RATE=115200",
            "-Wl,--section-start=.text=" + begin, "-Wl,--section-start=.version=" + version, "-Wl,--relax",
            "-nostartfiles", "-I", source, source + "/optiboot.c", "-o", elf},
        {"avr-objcopy", "-j", ".text", "-j", ".version", "--set-section-flags", ".version=alloc,load", "-O",
         "ihex", elf, hex.string()}}) {
    const io::ProcessResult result = io::run_process(command);
    ASSERT_EQ(result.status, 0) << result.err;
  }
}

struct UsbBoardSetup {
  std::filesystem::path bootloader;
  std::filesystem::path program = {};  // empty: erased flash
  std::string mcu = "atmega328p";
  std::filesystem::path flash = {};  // gets the flash's content at the end
  std::filesystem::path eeprom =
      {};               // gets the EEPROM's content at the end, gives it at the start if it exists
  bool frozen = false;  // what is written does not stay
  std::optional<long> unplugged_after = {};  // bytes from the PC
  std::optional<long> hangs_after_ms = {};
};

// What the sensor at A0 + `pin` reads in a program's `sample`-th scan of A0 to A4: a hand that moves slowly.
inline int sensor_counts(std::size_t sample, int pin) {
  constexpr std::size_t kPeriod = 40;  // samples
  const std::size_t phase = (sample + 3 * static_cast<std::size_t>(pin)) % kPeriod;
  return 480 + 10 * static_cast<int>(std::min(phase, kPeriod - phase));
}

class UsbBoard {
 public:
  explicit UsbBoard(const UsbBoardSetup& setup)
      : setup_(setup), firmware_{content(setup.program), {}, setup.mcu}, board_(firmware_) {
    connect();
    board_.put_bootloader(content(setup_.bootloader));
    const std::span<std::uint8_t> flash = board_.flash();
    if (setup_.frozen) frozen_.assign(flash.begin(), flash.end());
    if (std::filesystem::exists(setup_.eeprom))
      std::ranges::copy(io::read_file(setup_.eeprom), board_.eeprom().bytes);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~UsbBoard() { finish(); }
  UsbBoard(const UsbBoard&) = delete;
  UsbBoard& operator=(const UsbBoard&) = delete;

  const std::string& port() const { return name_; }

  // Switches it off. How many milestones (firmware/markers.hpp) the program has passed since the last reset.
  long finish() {
    if (!thread_.joinable()) return milestones_;
    thread_.request_stop();
    thread_.join();
    keep(board_.flash(), setup_.flash);
    keep({board_.eeprom().bytes, Board::kEepromBytes}, setup_.eeprom);
    return milestones_;
  }

 private:
  static deploy::FlashContent content(const std::filesystem::path& hex) {
    constexpr std::size_t kFlashBytes = 32768;
    return hex.empty() ? deploy::FlashContent{} : deploy::read_intel_hex(hex, kFlashBytes);
  }

  static void keep(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
    if (!file.empty()) io::write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  void connect() {
    board_.on_marker = [this](Cycles, std::uint8_t) { ++milestones_; };
    board_.on_bite = [this](Cycles) { milestones_ = 0; };
    board_.on_byte = [this](Cycles, std::uint8_t byte) {
      if (port_->is_open()) outgoing_ += static_cast<char>(port_->on_the_wire(byte, board_.baud()));
    };
    board_.on_sample = [this](Cycles, int pin) {
      constexpr std::size_t kSensors = 5;
      return sensor_counts(conversions_++ / kSensors, pin);
    };
  }

  void run(const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    for (long ms = 0; !stop.stop_requested() && received_ < setup_.unplugged_after.value_or(received_ + 1);
         ++ms) {
      if (setup_.hangs_after_ms == ms) board_.hang(false);
      exchange();
      board_.run_until(board_.now() + kCyclesPerMs);
      if (setup_.frozen) std::ranges::copy(frozen_, board_.flash().begin());
      due = std::max(due + std::chrono::milliseconds(1),
                     std::chrono::steady_clock::now() - std::chrono::milliseconds(20));
      std::this_thread::sleep_until(due);
    }
    port_.reset();
  }

  void exchange() {
    if (port_->was_opened()) {
      board_.reset();
      outgoing_.clear();
      milestones_ = 0;
      conversions_ = 0;
    }
    const double baud = board_.baud();
    for (const std::uint8_t byte : port_->read()) {
      complete_ = std::max(complete_, board_.now()) + static_cast<Cycles>(10000 * kCyclesPerMs / baud);
      board_.receive(complete_, port_->on_the_wire(byte, baud));
      ++received_;
    }
    outgoing_.erase(0, port_->write(outgoing_));
  }

  UsbBoardSetup setup_;
  Firmware firmware_;
  Board board_;
  std::optional<UsbPort> port_{std::in_place};
  std::string name_ = port_->name();
  std::string outgoing_;
  std::vector<std::uint8_t> frozen_;
  long milestones_ = 0;
  std::size_t conversions_ = 0;  // of the program
  long received_ = 0;            // bytes
  Cycles complete_ = 0;          // when the last byte is
  std::jthread thread_;
};

// Boards behind Optiboot, and a glove for them.
class OnUsb : public testing::Test {
 protected:
  void SetUp() override {
    FLEXOR_NEEDS_TERMINALS();
    if (!std::filesystem::exists(kBootloaders))
      GTEST_SKIP() << "arduino-core-avr is not installed: script/bootstrap --dev";
    build_optiboot("atmega328p", "0x7e00", "0x7ffe", boot());
  }

  std::filesystem::path boot() const { return folder_ / "boot.hex"; }
  static std::string path_of(const std::string& model) {
    return std::string(FLEXOR_SOURCE_DIR) + "/models/" + model + ".json";
  }
  static deploy::Glove glove_of(const std::string& model, const deploy::Key& key = {}) {
    return deploy::glove_for({}, model::load(path_of(model)), key);
  }
  static void write(const std::filesystem::path& hex, const deploy::FlashContent& content) {
    std::filesystem::create_directories(hex.parent_path());
    io::write_file(hex, deploy::to_intel_hex(content));
  }

  const io::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
  const link::Key key_ = deploy::key_from_hex("000102030405060708090a0b0c0d0e0f");
};

}  // namespace flexor::cosim
