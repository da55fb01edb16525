#include "host/listen/log.hpp"

#include <fmt/format.h>

#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::listen {
namespace {

constexpr double kFlush_s = 1;

}  // namespace

Log::Log(const std::filesystem::path& path, const std::vector<std::string>& columns)
    : file_(path), columns_(columns.size()) {
  lines_ = "t_s,host_s";
  for (const std::string& column : columns) lines_ += "," + recording::quoted(column);
  lines_ += '\n';
  try {
    flush();
  } catch (const io::JobError&) {  // an empty file would only stand in the way of the next recording
    file_.remove();
    throw;
  }
}

Log::~Log() {
  try {
    flush();
  } catch (const std::exception&) {  // what could not be written, add() has reported or the caller has asked
  }
}

void Log::add(const Sample& sample) {
  if (sample.value.size() != columns_)
    throw io::JobError("a sample of {} values, where the recording has {} columns", sample.value.size(),
                       columns_);
  ++rows_;
  lines_ += fmt::format("{:.6f},{:.6f}", clock_.time_s(sample), sample.host_s);
  for (const double value : sample.value) lines_ += fmt::format(",{}", value);
  lines_ += '\n';
  flush_if_due(sample.host_s);
}

void Log::flush_if_due(double host_s) {
  if (host_s - flushed_s_ < kFlush_s) return;
  flushed_s_ = host_s;
  flush();
}

// Where not all of it has room, the lines that do.
void Log::flush() {
  try {
    file_.append(lines_);
    lines_.clear();
  } catch (const io::JobError&) {
    do {
      const std::size_t line = lines_.find('\n') + 1;
      file_.append(std::string_view(lines_).substr(0, line));
      lines_.erase(0, line);
    } while (!lines_.empty());
  }
}

}  // namespace flexor::listen
