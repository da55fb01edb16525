// Samples as a wide CSV that grows: t_s, host_s, then the columns.
//
// t_s is the samples' clock (sample_clock.hpp), host_s the host's monotonic clock of the same instant. Only whole lines are written,
// each second or so: after a crash or `kill -9` the file is a recording without its last second, and a full disk leaves the
// lines that it had room for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/io/growing_file.hpp"
#include "host/listen/sample_clock.hpp"

namespace flexor::listen {

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
