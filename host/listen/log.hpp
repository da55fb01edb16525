// Samples as a wide CSV that grows: t_s, host_s, then the columns.
//
// t_s is the samples' clock (sample_clock.hpp), host_s the host's monotonic clock of the same instant. Only whole lines are written,
// each second or so: after a crash or `kill -9` the file is a recording without its last second, and a full disk leaves the
// lines that it had room for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/io/growing_file.hpp"
#include "host/listen/sample_clock.hpp"

namespace flexor::listen {

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
