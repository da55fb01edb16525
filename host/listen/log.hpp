// Samples as a wide CSV that grows: t_s, host_s, then the columns.
//
// t_s is the board's clock where it has one, from 0 at the first sample, else the host's, and rises strictly; host_s is
// the host's monotonic clock of the same instant. A board that starts anew goes on where the host's clock says. Only
// whole lines are written, each second or so: after a crash or `kill -9` the file is a recording without its last
// second, and a full disk leaves the lines that it had room for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/listen/decoder.hpp"

namespace flexor::listen {

class Log {
 public:
  // Throws io::InputError: there is such a file, no such folder, no permission.
  Log(const std::filesystem::path& path, const std::vector<std::string>& columns);
  ~Log();  // flushes, errors or not
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  // Throws io::JobError, one line: the disk is full or gone.
  void add(const Sample& sample);
  void flush();

  std::uint64_t rows() const { return rows_; }
  std::uint64_t restarts() const { return restarts_; }  // of the board's clock
  double duration_s() const { return last_s_; }

 private:
  double time_s(const Sample& sample);

  std::filesystem::path path_;
  int file_ = -1;
  std::string lines_;
  double flushed_s_ = 0;  // host's
  std::uint64_t rows_ = 0;
  std::uint64_t restarts_ = 0;
  double first_host_s_ = 0;
  double last_host_s_ = 0;
  double last_s_ = 0;
  double last_board_s_ = 0;
};

}  // namespace flexor::listen
