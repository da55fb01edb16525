// A simulated board on a pseudo-terminal, for tests: says the port in one line, runs until its standard input ends, then
// says how many milestones the program has passed since the last reset. GPL-3.0-or-later, because it links simavr.
//   usb_board bootloader=FILE.hex [mcu=NAME] [program=FILE.hex] [frozen=yes] [unplugged_after=BYTES] [flash=FILE]
//             [eeprom=FILE] [hangs_after=MS]
// flash: the flash's content goes there at the end; eeprom: likewise, and comes from there where the file is.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <string>

#include "cosim/usb_board.hpp"
#include "host/io/io.hpp"

namespace {

using namespace flexor;

constexpr std::size_t kFlashBytes = 32768;

void run(const std::map<std::string, std::string>& arguments) {
  cosim::UsbBoardOptions options;
  options.bootloader = deploy::read_intel_hex(arguments.at("bootloader"), kFlashBytes);
  if (arguments.contains("mcu")) options.mcu = arguments.at("mcu");
  if (arguments.contains("program"))
    options.program = deploy::read_intel_hex(arguments.at("program"), kFlashBytes);
  options.frozen = arguments.contains("frozen");
  if (arguments.contains("unplugged_after"))
    options.unplugged_after = std::stol(arguments.at("unplugged_after"));
  const bool keeps = arguments.contains("eeprom");
  if (keeps && std::filesystem::exists(arguments.at("eeprom")))
    options.eeprom = io::read_file(arguments.at("eeprom"));
  cosim::UsbBoard board(options);
  fmt::print("{}\n", board.port());
  std::fflush(stdout);
  if (arguments.contains("hangs_after")) {
    board.run_ms(std::stoi(arguments.at("hangs_after")));
    board.hang();
  }
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; poll(&input, 1, 0) == 0 && board.is_plugged_in();)
    board.run_ms(2);
  if (arguments.contains("flash")) io::write_file(arguments.at("flash"), board.flash());
  if (keeps) io::write_file(arguments.at("eeprom"), board.eeprom());
  fmt::print("{}\n", board.markers());
}

}  // namespace

int main(int argc, char** argv) {
  std::map<std::string, std::string> arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    const std::size_t equals = text.find('=');
    if (equals != std::string::npos) arguments[text.substr(0, equals)] = text.substr(equals + 1);
  }
  try {
    run(arguments);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "usb_board: {}\n", error.what());
    return 1;
  }
}
