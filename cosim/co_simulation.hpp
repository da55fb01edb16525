// Both boards, the radio between them and the twin's world around them: a whole trial, deterministic, in one
// thread.
#pragma once

#include <functional>

#include "cosim/board.hpp"
#include "cosim/byte_radio.hpp"
#include "host/deploy/config.hpp"
#include "host/twin/world.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {

struct Images {
  Images(const deploy::Glove& glove, const deploy::Hand& hand);

  Firmware glove;
  Firmware hand;
};

// hand_status of firmware/hand, as it lies in RAM.
struct __attribute__((packed)) HandStatus {
  std::uint8_t finger_bytes;
  std::uint8_t link;      // hand::Link
  std::uint8_t fault[5];  // hand::Fault
  std::int16_t setpoint[5];
  std::uint16_t overruns;
  std::int8_t duty[5];  // 127: the supply's whole voltage
  std::uint8_t board;   // hand::BoardFault
};

class CoSimulation {
 public:
  // All of them outlive the simulation.
  CoSimulation(const Images& images, const twin::TrialInput& input, std::uint64_t trial,
               ByteFaults faults = {});

  // Called before each millisecond, with the world's time: faults, attacks, traces, checks.
  std::function<void(std::int64_t now_ms)> on_ms;
  std::function<void(Cycles, std::uint8_t marker)> on_glove_marker;
  std::function<void(Cycles, std::uint8_t marker)> on_hand_marker;
  std::function<void(Cycles, std::uint8_t byte)> on_air;  // what the glove sends, before the radio's faults
  std::function<void(Cycles end, std::uint8_t byte)> on_arrival;  // and what arrives of it
  std::function<void(Cycles, std::uint8_t byte)> on_answer;       // what the hand sends
  // Overrides a sensor's reading: counts of finger at a time.
  std::function<int(std::int64_t now_ms, int finger, int counts)> on_reading;

  // Likewise a potentiometer's.
  std::function<int(std::int64_t now_ms, int finger, int counts)> on_potentiometer;

  // What arrives at the glove's radio, complete at `end`; without it the glove's pin gets it.
  std::function<void(Cycles end, std::uint8_t byte)> on_glove_air;

  // Runs to the end and returns what the cameras saw.
  twin::Trial run();
  // One millisecond of it, on_ms included.
  void step();
  // The minute of rest before a recording, in no time: loops have wound up as they do in it.
  void wind_up();

  Board& glove() { return glove_; }
  Board& hand() { return hand_; }
  const Board& hand() const { return hand_; }
  const twin::World& world() const { return world_; }
  twin::World& world() { return world_; }
  HandStatus hand_status() const;  // set-points: of the last tick
  link::LinkStatistics link_statistics() const;
  // Puts bytes on the glove's RX pin, one byte-time apart, from now on.
  void inject_to_glove(const std::vector<std::uint8_t>& bytes);
  // Puts bytes on the hand's RX pin, one byte-time apart, from now on.
  void inject(const std::vector<std::uint8_t>& bytes);
  bool glove_has_radio = true;  // false: what its UART sends goes nowhere else than to on_air
  bool radio_on = true;         // false: nothing arrives at either end
  // Neither is in a burst of losses, as of the last frame that way.
  bool both_ways_are_good() const { return !radio_[0].is_bad() && !radio_[1].is_bad(); }

  static Cycles cycle_of(double t_ms) {
    return static_cast<Cycles>((t_ms - twin::World::kStart_ms) * kCyclesPerMs);
  }
  static double time_ms(Cycles cycle) {
    return static_cast<double>(cycle) / kCyclesPerMs + twin::World::kStart_ms;
  }

 private:
  enum class From { glove, hand };
  void on_the_air(From from, Cycles begin, std::uint8_t byte);
  Cycles byte_cycles() const { return cosim::byte_cycles(input_.parameters.baud); }
  bool collides(From from, Cycles begin);

  const Images& images_;
  const twin::TrialInput& input_;
  twin::World world_;
  Board glove_;
  Board hand_;
  std::array<ByteRadio, 2> radio_;  // by From
  struct Burst {
    Cycles begin = 0;
    Cycles end = 0;
  };
  std::array<Burst, 2> air_;   // the newest of either end
  Cycles collided_until_ = 0;  // the modules send or listen: where both send, neither is received
  HandStatus ticked_{};
  Cycles injected_until_ = 0;
  int sent_ = 0;
};

}  // namespace flexor::cosim
