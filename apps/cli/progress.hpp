// Progress on standard error: one line that rewrites itself for a person, now and then a line in a log; or to whoever asked for
// the job.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string>

#include "apps/cli/job.hpp"
#include "host/io/posix.hpp"

namespace flexor::cli {

class ProgressLine {
 public:
  ProgressLine() : terminal_(::isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (terminal_ && shown_) write("\r\033[K");
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const std::string& text) { show(io::Progress{text}); }

  // Step `done` of `of` (0: not known) begins; from two seconds on with the time left, as fast as it went so
  // far. A further run of steps starts its own clock.
  void step(const std::string& what, std::size_t done, std::size_t of) {
    const auto now = std::chrono::steady_clock::now();
    if (done < last_done_) begin_ = now;
    last_done_ = done;
    const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
    io::Progress progress{what, done, of};
    if (elapsed_s > 2 && done > 0 && done < of)
      progress.seconds_left = elapsed_s * static_cast<double>(of - done) / static_cast<double>(done);
    show(progress);
  }

  // As deploy::Bootloader and listen::Listener say what they do, of one of several boards: `of` before it.
  auto percents(const std::string& of = "") {
    return [this, of](const std::string& what, int done) { percent(of + what, done); };
  }
  auto steps(const std::string& of) {
    return [this, of](const std::string& what) { show(of + what + " ..."); };
  }

  // What is counted in percent; 0: it begins, or cannot be counted.
  void percent(const std::string& what, int percent) {
    if (percent > 0) return step(what + ", percent", static_cast<std::size_t>(percent), 100);
    last_done_ = 0;
    begin_ = std::chrono::steady_clock::now();
    show(what + " ...");
  }

 private:
  void show(const io::Progress& p) {
    io::go_on();
    const bool often = terminal_ || job_output != nullptr;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(often ? 100 : 2000)) return;
    last_ = now;
    if (job_output != nullptr) return job_output->show(p);
    shown_ = true;
    std::string text = p.stage;
    if (p.done > 0 || p.of > 0) text += fmt::format(" {}", p.done);
    if (p.of > 0) text += fmt::format(" of {}", p.of);
    if (p.seconds_left) text += fmt::format(", about {:.0f} s left", *p.seconds_left);
    write(terminal_ ? "\r\033[K" + text : text + "\n");
  }

  static void write(const std::string& text) { (void)std::fputs(text.c_str(), stderr); }

  bool terminal_;
  bool shown_ = false;
  std::size_t last_done_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_ = begin_;
};

}  // namespace flexor::cli
