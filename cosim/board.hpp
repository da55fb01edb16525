// One simulated ATmega328P at 16 MHz: an image run instruction by instruction, its pins and
// registers open to the world.
//
// Times are cycles since the world began; a board that is switched on later, or off for a while, keeps
// counting.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "host/deploy/intel_hex.hpp"
#include "host/deploy/mcu.hpp"

namespace flexor::cosim {

using Cycles = std::uint64_t;
inline constexpr Cycles kCyclesPerMs = 16000;
constexpr Cycles byte_cycles(double baud) { return static_cast<Cycles>(10 / baud * 1000 * kCyclesPerMs); }

// What any number of boards have in flash.
struct Firmware {
  deploy::FlashContent content;
  std::map<std::string, std::uint16_t> symbols = {};  // addresses in RAM, as deploy::Image has them
  std::string mcu = deploy::kAtmega328p.name;

  // Throws io::JobError where the image has no such symbol.
  std::uint16_t address(const std::string& symbol) const;
};

class Board {
 public:
  explicit Board(const Firmware& firmware);
  ~Board();
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  // Called while run_until() runs.
  std::function<void(Cycles, std::uint8_t byte)> on_byte;      // the UART began to send it
  std::function<void(Cycles, std::uint8_t marker)> on_marker;  // GPIOR0 was written
  std::function<int(Cycles, int pin)> on_sample;  // an ADC conversion of A0 .. A5 starts: its counts
  std::function<void(Cycles)> on_bite;            // the watchdog has reset it

  void run_until(Cycles end);
  Cycles now() const;

  // What the next conversions of this pin, A0 .. A7, give without on_sample.
  void set_counts(int pin, int counts);
  // A level at D2 .. D12 from outside.
  void set_pin(int digital, bool high);
  // The supply, which is the converter's reference, until the next start; potentiometers hang on it, too.
  void set_supply(int mV);
  // The byte is complete on the RX pin at `end`; calls come in order.
  void receive(Cycles end, std::uint8_t byte);

  // Beside the program, at the flash's end: where a reset goes from now on, as by fuse BOOTRST. The board starts again.
  void put_bootloader(const deploy::FlashContent& bootloader);
  // The reset pin, as the capacitor at DTR pulls it.
  void reset();
  // The UART's, by its registers.
  double baud() const;

  // Supply off until `until`: registers and RAM are lost, EEPROM is not. Also for a late start.
  void power_off(Cycles until);
  // From now on the program goes round in circles: at the end of avr-libc's exit(), which main never comes to. Throws
  // io::JobError when the flash has no such end.
  void hang(bool interrupts);

  // -1 .. 1: share of full voltage on motor 0 .. 4 of the hand, by PWM, direction and enable pin.
  double duty(int motor) const;
  // The motor's driver gives this share whatever its PWM and direction are; its enable input works on.
  void stick(int motor, double share) { stuck_[motor] = share; }

  std::uint8_t read(std::uint16_t address) const;
  void write(std::uint16_t address, std::uint8_t byte);
  template <class T>
  T peek(std::uint16_t address) const {
    T out{};
    for (std::size_t i = 0; i < sizeof(T); ++i)
      reinterpret_cast<std::uint8_t*>(&out)[i] = read(static_cast<std::uint16_t>(address + i));
    return out;
  }

  // What lasts without supply; for link::CounterStore, too.
  struct Eeprom {
    std::uint8_t* bytes;
    std::uint8_t read(std::uint16_t address) const { return bytes[address]; }
    bool ready() const { return true; }
    void write(std::uint16_t address, std::uint8_t byte) { bytes[address] = byte; }
  };
  static constexpr int kEepromBytes = 1024;
  Eeprom eeprom();
  std::span<std::uint8_t> flash();

  // Most bytes of stack that were in use since power-on.
  int stack_bytes() const;
  Cycles awake_cycles() const { return awake_; }

 private:
  struct Held {  // of a port, a bit each
    unsigned pins = 0;
    unsigned high = 0;
  };
  struct Hooks;
  void listen_to_motors();
  void power_on();
  void after_reset();
  void schedule_byte();

  const Firmware& firmware_;
  void* avr_ = nullptr;  // avr_t: simavr stays inside board.cpp
  void* uart_ = nullptr;
  std::uint16_t ram_end_ = 0;
  std::uint64_t byte_cycles_ = 0;
  bool off_ = false;
  int supply_mV_ = 0;
  Cycles on_at_ = 0;
  Cycles awake_ = 0;
  struct Byte {
    Cycles end;
    std::uint8_t value;
  };
  std::deque<Byte> incoming_;
  std::array<int, 5> width_{};
  std::map<char, Held> held_;
  std::map<int, double> stuck_;
};

}  // namespace flexor::cosim
