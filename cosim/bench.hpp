// Both boards in the twin's world for as long as one likes, in step with real time, and the glove's USB on a
// pseudo-terminal (host/study/bench.hpp has its purpose).
//
// The glove has one UART, as on the real board: what it sends goes to the PC and to the radio, what comes from either comes
// to the same pin, and of two bytes at the same time one is lost. While its bootloader runs the radio does not reach
// that pin: docs/pairing.md has it unplugged for that. Opening the port resets the glove.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cosim/co_simulation.hpp"
#include "cosim/usb_port.hpp"
#include "host/io/io.hpp"
#include "host/io/worker.hpp"
#include "host/study/bench.hpp"
#include "host/twin/wearer.hpp"

namespace flexor::cosim {

struct BenchSetup {
  deploy::Glove glove;
  std::filesystem::path bootloader;  // Intel hex; empty: none
  twin::TrialInput input;            // its motion's beginning is how the hand rests
  std::filesystem::path link;        // to the pseudo-terminal; empty: none
};

class Bench {
 public:
  // Throws io::InputError, io::JobError.
  explicit Bench(BenchSetup setup);

  const std::string& terminal() const { return port_.name(); }
  study::BenchView advance(const study::BenchChange& change);
  std::vector<double> score(const std::vector<int>& gestures, const io::JobProgress& progress);

 private:
  using Clock = std::chrono::steady_clock;
  struct Coming {
    Cycles end;
    std::uint8_t byte;
  };

  void connect();
  void play(const std::string& motion);
  void change(const study::BenchChange& change);
  void step();
  void look_at_port();
  void feed_glove();
  std::int64_t until_phase_ms() const;
  double score_one(int gesture, const std::function<void()>& each);
  study::BenchView view() const;

  BenchSetup setup_;
  Images images_;
  double radio_loss_;  // of the configuration
  CoSimulation simulation_;
  twin::Wearer wearer_;
  twin::Random noise_;
  std::string motion_ = "rest";
  std::array<int, twin::kFingers> counts_{};
  study::WornChange worn_;
  double drifted_deg_ = 0;

  UsbPort port_;
  std::optional<io::Temporary> link_;
  bool program_runs_ = false;  // not the bootloader
  Cycles sampled_ = 0;         // the glove, last
  bool pc_listens_ = true;
  std::deque<std::uint8_t> typed_;  // by the PC, not yet on the wire
  Cycles typed_until_ = 0;
  std::deque<Coming> radio_;
  Cycles line_busy_until_ = 0;  // the glove's RX
  std::string unread_;          // to the PC
  Clock::time_point due_;
};

}  // namespace flexor::cosim
