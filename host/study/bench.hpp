// Both simulated boards, worn by the twin in real time, with the glove's USB on a pseudo-terminal: a glove and its hand
// for whoever has none. The boards run in a worker, flexor-cosim (cosim/bench.hpp).
//
// The glove runs its real image behind Optiboot, where Debian's arduino-core-avr is there to build it from, else without
// a bootloader. The hand is the published one (twin_hand), on the radio all the time.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "host/deploy/config.hpp"
#include "host/io/io.hpp"
#include "host/io/pipe_json.hpp"
#include "host/io/worker.hpp"
#include "host/study/catalogue.hpp"

namespace flexor::study {

// "rest", "bends", "calibration", "held", "ordinary", "protocol" or "1" to "6"; none: rest. Throws io::InputError, listing them.
std::optional<twin::Motion> bench_motion(const std::string& name);

// What goes wrong with a glove that is worn, beside the configuration's.
struct WornChange {
  double slip_deg = 0;           // each sensor, the same way, beside what the donning drew
  double drift_deg_per_min = 0;  // each sensor, the same way, from now on
  double noise_counts = 0;       // standard deviation of each reading
  double loss = 0;               // share of the radio's frames, both ways; without boards of the samples, too
};
FLEXOR_PIPE(WornChange, slip_deg, drift_deg_per_min, noise_counts, loss)

// How it goes on.
struct BenchChange {
  WornChange worn = {};
  std::optional<std::string> motion = {};  // bench_motion(); another one begins again; none: as before
  bool restart = false;                    // the same one begins again, too
};

struct BenchView {
  std::int64_t now_ms = 0;  // simulated, since the boards were switched on
  std::array<double, kFingers> finger_deg{};
  std::array<double, kFingers> joint_deg{};  // of the bionic hand
  std::array<int, kFingers> fault{};         // hand::Fault
  std::array<int, kFingers> counts{};        // the glove's last conversions
};

FLEXOR_PIPE(BenchChange, worn, motion, restart)
FLEXOR_PIPE(BenchView, now_ms, finger_deg, joint_deg, fault, counts)

// The old Nanos', 57600 baud, of Debian's package.
inline constexpr const char* kBootloader =
    "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex";
// Why a simulated glove has no bootloader, with the mend; "": it has.
std::string why_no_bootloader();

struct BenchOptions {
  twin::Parameters parameters = {};
  model::Model model;      // five fingers; the glove's first
  std::uint64_t seed = 1;  // whoever wears it is that of the experiment's trial 0 with this seed
  std::filesystem::path port_link = {};  // a name for the port; empty: the pseudo-terminal's own
};

// Calls may come from any thread; one waits for another.
class Bench {
 public:
  // Throws io::InputError: no such worker, a model that does not fit,
  // a port_link that is something else; io::JobError.
  Bench(const std::filesystem::path& program, const BenchOptions& options);
  ~Bench();

  // As it is opened: the link, or the pseudo-terminal.
  const std::string& port() const { return port_; }
  const deploy::Key& key() const { return glove_.key; }

  // 20 ms of simulated time and, but for at most 50 ms that it lags behind, as much real time.
  BenchView advance(const BenchChange& change);

  // Integral of the absolute error of each of these gestures, all fingers, deg s, as the experiment has it, on the boards
  // as they are now; in no real time. What the glove sends meanwhile goes nowhere. Afterwards the present motion begins
  // again. Throws io::Cancelled where `progress` asks to stop.
  std::vector<double> score(const std::vector<int>& gestures, const io::JobProgress& progress);

 private:
  deploy::Glove glove_;
  std::mutex mutex_;
  io::Worker worker_;
  std::string port_;
};

}  // namespace flexor::study
