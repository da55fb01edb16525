// A board as a PC sees it: a microcontroller with its bootloader behind a serial port, here a pseudo-terminal, in real
// time. Opening the port resets the board, as the capacitor at DTR does; bytes at another rate than the UART's arrive as
// noise. For tests of what flashes boards, and of what speaks with the program behind the bootloader.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>

#include "cosim/usb_port.hpp"
#include "host/deploy/intel_hex.hpp"

namespace flexor::cosim {

struct UsbBoardOptions {
  std::string mcu = "atmega328p";
  deploy::FlashContent bootloader;              // its begin is where a reset goes: fuse BOOTRST
  std::optional<deploy::FlashContent> program;  // none: erased flash
  bool frozen = false;                          // what is written does not stay
  std::optional<long> unplugged_after;          // bytes from the PC
  std::string eeprom;                           // what was there before; empty: erased
};

// What the strip at A0 + `pin` reads in a program's `sample`-th scan of A0 to A4: a hand that moves slowly.
inline int strip_counts(std::size_t sample, int pin) {
  constexpr std::size_t kPeriod = 40;  // samples
  const std::size_t phase = (sample + 3 * static_cast<std::size_t>(pin)) % kPeriod;
  return 480 + 10 * static_cast<int>(std::min(phase, kPeriod - phase));
}

class UsbBoard {
 public:
  // Throws io::JobError.
  explicit UsbBoard(const UsbBoardOptions& options);
  ~UsbBoard();
  UsbBoard(const UsbBoard&) = delete;
  UsbBoard& operator=(const UsbBoard&) = delete;

  const std::string& port() const { return port_.name(); }

  // So much simulated time, and at least as much real time.
  void run_ms(int ms);

  bool is_plugged_in() const { return !options_.unplugged_after || received_ < *options_.unplugged_after; }

  // The program goes round in circles from now on, deaf to interrupts.
  void hang();

  // All of them.
  std::string flash() const;
  std::string eeprom() const;
  // Milestones (firmware/markers.hpp) since the last reset: 0 while the bootloader runs.
  std::uint64_t markers() const { return markers_; }

 private:
  struct Hooks;
  void reset();
  void exchange();
  void run_millisecond();
  std::uint64_t byte_cycles() const;
  double baud() const;

  UsbBoardOptions options_;
  void* avr_ = nullptr;  // avr_t: simavr stays inside usb_board.cpp
  UsbPort port_;
  std::deque<std::uint8_t> incoming_;
  std::string outgoing_;
  std::string frozen_;
  std::uint64_t markers_ = 0;
  std::size_t conversions_ = 0;  // of the program
  long received_ = 0;            // bytes
  std::chrono::steady_clock::time_point due_;
};

}  // namespace flexor::cosim
