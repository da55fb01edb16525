// For tests: the program usb_board, a board on a pseudo-terminal, and `flexor` as a user runs it.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/io/process.hpp"
#include "host/io/terminal_test.hpp"
#include "host/study/bench.hpp"

namespace flexor::cosim {

inline const std::filesystem::path kBootloaders = "/usr/share/arduino/hardware/arduino/avr/bootloaders";
inline const std::filesystem::path kOldBootloader = kBootloaders / "atmega/ATmegaBOOT_168_atmega328.hex";

inline void build_optiboot(const std::string& mcu, const std::string& begin, const std::string& version,
                           const std::filesystem::path& hex) {
  ASSERT_TRUE(study::build_optiboot(hex, mcu, begin, version));
}

// As usb_board takes it.
inline std::string option(const char* name, const std::filesystem::path& path) {
  return fmt::format("{}={}", name, path.string());
}

// The helper program, with both ends of its pipes.
class UsbHelper {
 public:
  explicit UsbHelper(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "usb_board");
    process_.emplace(std::filesystem::path(FLEXOR_USB_BOARD), arguments,
                     std::vector<io::HandedOn>{{in_.end(0), STDIN_FILENO}, {out_.end(1), STDOUT_FILENO}});
    in_.close_end(0);
    out_.close_end(1);
    port_ = line();
  }
  ~UsbHelper() { finish(); }
  UsbHelper(const UsbHelper&) = delete;
  UsbHelper& operator=(const UsbHelper&) = delete;
  const std::string& port() const { return port_; }

  // Its end; how many milestones the program had passed.
  long finish() {
    if (!process_) return 0;
    in_.close_end(1);
    const std::string said = line();
    process_->wait();
    process_.reset();
    return said.empty() ? 0 : std::stol(said);
  }

 private:
  std::string line() {
    std::string text;
    for (char c = 0; read(out_.end(0), &c, 1) == 1 && c != '\n';) text += c;
    return text;
  }
  io::Pipe in_;
  io::Pipe out_;
  std::optional<io::Process> process_;
  std::string port_;
};

struct Finished {
  int exit = 0;
  std::string out;
  std::string err;
};

inline Finished flexor(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), std::filesystem::absolute(FLEXOR_PROGRAM).string());
  const io::ProcessResult result = io::run_process(arguments);
  return {result.status, result.out, result.err};
}

// The last thing on standard error is one line of the program's with these words.
inline void expect_says(const Finished& r, int exit, const std::string& says) {
  EXPECT_EQ(r.exit, exit) << r.err;
  const std::size_t from = r.err.rfind("flexor: ");
  const std::string last = r.err.substr(from == std::string::npos ? 0 : from);
  EXPECT_NE(last.find(says), std::string::npos) << r.err;
  EXPECT_EQ(std::count(last.begin(), last.end(), '\n'), 1) << r.err;
}

}  // namespace flexor::cosim
