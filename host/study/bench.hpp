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

// What is to change before the next milliseconds; what is left out stays as it is.
struct BenchChange {
  int ms = 20;
  std::optional<double> slip_deg = {};  // each strip, the same way, beside what the donning drew
  std::optional<double> drift_deg_per_min =
      {};  // each strip, the same way, from now on, beside the configuration's
  std::optional<double> noise_counts = {};  // standard deviation of each reading, beside the configuration's
  std::optional<double> loss = {};          // share of frames, both ways, beside the configuration's
  std::optional<std::string> motion = {};   // bench_motion(); another one begins anew
  bool restart = false;                     // and so does the same one
  std::optional<bool> unplugged = {};       // the port is not there
};

struct BenchView {
  std::int64_t now_ms = 0;  // simulated, since the boards were switched on
  std::string port;         // empty: unplugged
  std::string motion;
  std::array<double, kFingers> finger_deg{};
  std::array<double, kFingers> joint_deg{};  // of the bionic hand
  std::array<int, kFingers> fault{};         // hand::Fault
  std::array<int, kFingers> counts{};        // the glove's last conversions
};

FLEXOR_PIPE(BenchChange, ms, slip_deg, drift_deg_per_min, noise_counts, loss, motion, restart, unplugged)
FLEXOR_PIPE(BenchView, now_ms, port, motion, finger_deg, joint_deg, fault, counts)

// The old Nanos', 57600 baud, of Debian's package.
inline constexpr const char* kBootloader =
    "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex";
// Why a simulated glove has no bootloader, with the mend; "": it has.
std::string why_no_bootloader(const std::filesystem::path& hex = kBootloader);

struct BenchOptions {
  twin::Parameters parameters = {};
  model::Model model;      // five fingers; the glove's first
  std::uint64_t seed = 1;  // whoever wears it is that of the experiment's trial 0 with this seed
  std::filesystem::path port_link =
      {};  // a name for the port that stays; empty: the pseudo-terminal's own, which changes
};

// Calls may come from any thread; one waits for another.
class Bench {
 public:
  // Throws io::InputError: no such worker, a model that does not fit,
  // a port_link that is something else; io::JobError.
  Bench(std::filesystem::path program, const BenchOptions& options);
  ~Bench();

  // As it is opened: the link, or the pseudo-terminal; of that the last where it is unplugged.
  std::string port() const;
  const deploy::Key& key() const { return glove_.key; }
  bool has_bootloader() const { return has_bootloader_; }

  // So much simulated time and, but for at most 50 ms that it lags behind, as much real time.
  BenchView advance(const BenchChange& change);

  // Integral of the absolute error of each of these gestures, all fingers, deg s, as the experiment has it, on the boards
  // as they are now; in no real time. What the glove says meanwhile goes nowhere. Afterwards the present motion begins
  // anew. Throws io::Cancelled where `progress` says stop.
  std::vector<double> score(const std::vector<int>& gestures, const io::JobProgress& progress);

 private:
  deploy::Glove glove_;
  bool has_bootloader_ = false;
  std::filesystem::path link_;
  mutable std::mutex mutex_;
  std::string terminal_;
  io::Worker worker_;
};

}  // namespace flexor::study
