// Samples as a wide CSV that grows: t_s, host_s, then the columns.
//
// t_s is the samples' clock (SampleClock), host_s the host's monotonic clock of the same instant. Only whole lines are written,
// each second or so: after a crash or `kill -9` the file is a recording without its last second, and a full disk leaves the
// lines that it had room for.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "host/io/growing_file.hpp"
#include "host/listen/decoder.hpp"
#include "host/recording/stream.hpp"

namespace flexor::listen {

// The time of samples from the two clocks that they come with: the board's where it has one, from 0 at the first sample,
// else the host's. It rises strictly; a counter that wraps goes on, a board that starts again does so at the host's time.
class SampleClock {
 public:
  double time_s(const Sample& sample) {
    constexpr double kLeastStep_s = 1e-4;  // of samples that came in one burst, without a clock of their own
    constexpr double kAstray_s =
        1;  // of the board's clock from the host's, between two samples: it started again
    constexpr double kLate_s =
        0.25;  // by which lines come late: a counter's wrap differs by less from the host's step
    const bool is_first = !std::exchange(has_begun_, true);
    if (is_first) first_host_s_ = last_host_s_ = sample.host_s;
    const double host_step_s = sample.host_s - std::exchange(last_host_s_, sample.host_s);
    double t_s = sample.host_s - first_host_s_;
    if (sample.board_s) {
      double step_s = *sample.board_s - std::exchange(last_board_s_, *sample.board_s);
      for (const double wrap_s : recording::kWraps_s) {
        if (step_s < 0 && std::abs(step_s + wrap_s - host_step_s) < kLate_s) step_s += wrap_s;
      }
      const bool is_restart = !is_first && (step_s < 0 || std::abs(step_s - host_step_s) > kAstray_s);
      restarts_ += is_restart ? 1 : 0;
      t_s = last_s_ + (is_restart ? host_step_s : step_s);
    }
    return last_s_ = is_first ? 0 : std::max(t_s, last_s_ + kLeastStep_s);
  }
  std::uint64_t restarts() const { return restarts_; }  // of the board's clock
  double last_s() const { return last_s_; }

 private:
  bool has_begun_ = false;
  std::uint64_t restarts_ = 0;
  double first_host_s_ = 0;
  double last_host_s_ = 0;
  double last_s_ = 0;
  double last_board_s_ = 0;
};

// When a recording ends, by the source's clock, of which samples are no measure: they may cease.
class Span {
 public:
  explicit Span(double for_s) : for_s_(for_s) {}  // 0: without an end
  void add_sample(double now_s) {
    if (!has_begun_) first_s_ = now_s;
    has_begun_ = true;
    last_s_ = now_s;
  }
  bool is_over(double now_s) const { return for_s_ > 0 && has_begun_ && now_s - first_s_ >= for_s_; }
  double silent_s(double now_s) const { return has_begun_ ? now_s - last_s_ : 0; }
  double left_s(double now_s) const { return std::max(0.0, for_s_ - (has_begun_ ? now_s - first_s_ : 0)); }

 private:
  double for_s_;
  bool has_begun_ = false;
  double first_s_ = 0;
  double last_s_ = 0;
};

class Log {
 public:
  // Throws io::InputError: there is such a file, no such folder, no permission; io::JobError: no room even for the header,
  // and then there is no file either.
  Log(const std::filesystem::path& path, const std::vector<std::string>& columns);
  ~Log();  // flushes, errors or not
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  // Throws io::JobError, one line: the disk is full or gone; another number of columns.
  void add(const Sample& sample);
  void flush();
  void flush_if_due(double host_s);  // likewise, also where no sample comes

  std::uint64_t rows() const { return rows_; }
  std::uint64_t restarts() const { return clock_.restarts(); }  // of the board's clock
  double duration_s() const { return clock_.last_s(); }

 private:
  io::GrowingFile file_;
  std::string lines_;
  std::size_t columns_;
  double flushed_s_ = 0;  // host's
  std::uint64_t rows_ = 0;
  SampleClock clock_;
};

}  // namespace flexor::listen
