#include "host/listen/log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::listen {
namespace {

constexpr double kFlush_s = 1;
constexpr double kLeastStep_s = 1e-4;  // of samples that came in one burst, without a clock of their own
constexpr double kAstray_s = 1;  // of the board's clock from the host's, between two samples: it started anew

}  // namespace

Log::Log(const std::filesystem::path& path, const std::vector<std::string>& columns) : path_(path) {
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0 && errno == EEXIST) {
    throw io::InputError(
        fmt::format("{}: is there already: a recording is never written over, name another", path.string()));
  }
  if (file_ < 0)
    throw io::InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  lines_ = "t_s,host_s";
  for (const std::string& column : columns) lines_ += "," + recording::quoted(column);
  lines_ += '\n';
  flush();
}

Log::~Log() {
  try {
    flush();
  } catch (const std::exception&) {  // what could not be written, add() has said or the caller has asked
  }
  ::close(file_);
}

double Log::time_s(const Sample& sample) {
  if (rows_ == 0) {
    first_host_s_ = last_host_s_ = sample.host_s;
    last_board_s_ = sample.board_s.value_or(0);
    return 0;
  }
  const double host_step_s = sample.host_s - last_host_s_;
  double t_s = sample.host_s - first_host_s_;
  if (sample.board_s) {
    const double step_s = *sample.board_s - last_board_s_;
    const bool anew = step_s < 0 || std::abs(step_s - host_step_s) > kAstray_s;
    restarts_ += anew ? 1 : 0;
    t_s = last_s_ + (anew ? host_step_s : step_s);
    last_board_s_ = *sample.board_s;
  }
  last_host_s_ = sample.host_s;
  return std::max(t_s, last_s_ + kLeastStep_s);
}

void Log::add(const Sample& sample) {
  last_s_ = time_s(sample);
  ++rows_;
  lines_ += fmt::format("{:.6f},{:.6f}", last_s_, sample.host_s);
  for (const double value : sample.value) lines_ += fmt::format(",{}", value);
  lines_ += '\n';
  if (sample.host_s - flushed_s_ < kFlush_s) return;
  flushed_s_ = sample.host_s;
  flush();
}

void Log::flush() {
  struct stat before {};
  ::fstat(file_, &before);
  std::size_t done = 0;
  while (done < lines_.size()) {
    const ssize_t n = ::write(file_, lines_.data() + done, lines_.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int cause = errno;
      // The line that only half of was written goes.
      const std::size_t whole = done == 0 ? 0 : lines_.rfind('\n', done - 1) + 1;
      (void)!::ftruncate(file_, before.st_size + static_cast<off_t>(whole));
      lines_.erase(0, whole);
      throw io::JobError(fmt::format("{}: cannot be written: {}: what came before is whole", path_.string(),
                                     std::strerror(cause)));
    }
    done += static_cast<std::size_t>(n);
  }
  lines_.clear();
}

}  // namespace flexor::listen
