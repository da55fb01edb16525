// A program that avr-gcc makes here, for a simulated board.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "cosim/board.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"

namespace flexor::cosim {

// command: the compiler, its options and sources; the output's name is appended.
inline Firmware compiled(std::vector<std::string> command) {
  const io::TemporaryFolder folder;
  const std::string elf = folder.path() / "program.elf";
  const std::string hex = folder.path() / "program.hex";
  const auto run = [](const std::vector<std::string>& argv) {
    const io::ProcessResult result = io::run_process(argv);
    if (result.status != 0) throw io::JobError(result.err.substr(0, 2000));
    return result.out;
  };
  command.insert(command.end(), {"-o", elf});
  run(command);
  run({"avr-objcopy", "-O", "ihex", "-R", ".eeprom", elf, hex});
  std::map<std::string, std::uint16_t> symbols;
  std::istringstream names(run({"avr-nm", "--defined-only", elf}));
  std::string address, kind, name;
  while (names >> address >> kind >> name)
    symbols[name] = static_cast<std::uint16_t>(std::stoul(address, nullptr, 16) & 0xffffU);
  return {deploy::read_intel_hex(hex, 32768), std::move(symbols)};
}

}  // namespace flexor::cosim
