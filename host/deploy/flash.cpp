#include "host/deploy/flash.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "host/io/serial.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::InputError;
using io::JobError;

constexpr const char* kProgrammer = "avrdude";
constexpr int kNewRate_Bd = 115200;
constexpr int kSilence_ms = 12000;  // twice as long as avrdude waits for an answer

// "0x1e950f (probably m328p)" behind "device signature = "; empty: it did not come so far.
std::string signature_in(const std::string& err) {
  constexpr std::string_view kBefore = "signature = ";
  const std::size_t at = err.find(kBefore);
  if (at == std::string::npos) return "";
  const std::size_t from = at + kBefore.size();
  return err.substr(from, err.find_first_of("\r\n", from) - from);
}

// The line in which `what` stands, without "avrdude error: "; empty: it stands nowhere.
std::string line_with(const std::string& err, const std::string& what) {
  const std::size_t at = err.find(what);
  if (at == std::string::npos) return "";
  const std::size_t begin = err.rfind('\n', at) + 1;
  std::string line = err.substr(begin, err.find('\n', at) - begin);
  for (const char* head : {"avrdude error: ", "avrdude OS error: ", "avrdude: "}) {
    if (line.starts_with(head)) line.erase(0, std::string_view(head).size());
  }
  line.erase(0, line.find_first_not_of(' '));
  return line.substr(0, line.find(" (error)"));
}

// How far the last bar is that avrdude draws, fifty signs long; -1: none yet.
int percent_in(const std::string& err, std::string& what) {
  const std::size_t bar = err.rfind("ing | ");
  if (bar == std::string::npos) return -1;
  const std::size_t word = err.find_last_of("\n\r", bar) + 1;
  what = err.substr(word, bar - word) == "Writ" ? "writing" : "reading";
  const std::string drawn = err.substr(bar, 60);
  return 2 * static_cast<int>(std::ranges::count(drawn, '#'));
}

}  // namespace

fs::path image_of(const std::string& what, const std::string& board) {
  std::error_code error;
  fs::path path = what;
  if (!fs::is_directory(path, error)) {
    if (!fs::exists(path, error)) throw InputError("{}: no such file or folder", what);
    if (!board.empty()) throw InputError("{}: is one image: --board is for the folder of a deployment", what);
    return path;
  }
  if (!board.empty()) return path / (board + ".hex");
  const bool glove = fs::exists(path / "glove.hex", error);
  const bool hand = fs::exists(path / "hand.hex", error);
  if (glove && hand)
    throw InputError("{}: holds images of both boards: give --board glove or --board hand", what);
  if (!glove && !hand) throw InputError("{}: holds no image: flexor deploy --out writes them", what);
  return path / (glove ? "glove.hex" : "hand.hex");
}

FlashContent read_image(const fs::path& hex) {
  FlashContent image = read_intel_hex(hex, kOptibootBegin);
  const auto room = static_cast<std::size_t>(kAtmega328p.flash_bytes);
  if (image.bytes.size() > room) {
    throw InputError("{}: ends at 0x{:x}, the bootloader of an {} begins at 0x{:x}", hex.string(),
                     image.bytes.size(), kAtmega328p.printed, room);
  }
  // What a finished board's dump holds, too, and no image of a program does.
  if (image.begin != 0)
    throw InputError("{}: begins at 0x{:x}: an image begins at 0", hex.string(), image.begin);
  return image;
}

std::string choose_port(const std::string& port, const fs::path& dev) {
  if (port != "auto") return io::require_port(port);
  const std::vector<std::string> found = io::serial_ports(dev);
  if (found.empty())
    throw InputError("no board found: plug it in with a cable that carries data, or name its --port");
  if (found.size() > 1)
    throw InputError("{} ports may be the board: name one with --port: {}", found.size(),
                     fmt::join(found, ", "));
  return io::require_port(found.front());
}

Bootloader::Bootloader(std::string port, int baud, FlashProgress progress)
    : port_(std::move(port)), rates_Bd_{baud, baud}, progress_(std::move(progress)) {
  if (baud == 0) rates_Bd_ = {kNewRate_Bd, kOldRate_Bd, kNewRate_Bd, kOldRate_Bd};
  if (io::find_program(kProgrammer).empty())
    throw InputError(
        "{0} is missing: install the package {0}, or put it with its {0}.conf beside flexor; the zip for "
        "Windows has both",
        kProgrammer);
}

// `operation` as avrdude writes it: flash:w:FILE:i.
bool Bootloader::run(const std::string& operation, const fs::path& folder) {
  const std::string rate = std::to_string(rates_Bd_.front());
  const bool writes = operation.starts_with("flash:w");
  std::string what = "connecting";
  const auto on_err = [&](const std::string& err) {
    const int percent = percent_in(err, what);
    if (writes && what == "reading") what = "verifying";
    if (percent >= 0) progress_(what, percent);
  };
  progress_(fmt::format("connecting at {} baud", rate), 0);
  const std::vector<std::string> command = {kProgrammer, "-c",         "arduino", "-p",     kAtmega328p.part,
                                            "-P",        port_,        "-b",      rate,     "-D",
                                            "-x",        "attempts=1", "-U",      operation};
  const io::ProcessResult result = io::run_process(command, folder, {on_err, kSilence_ms});
  if (result.status == 0) return true;
  const std::string signature = signature_in(result.err);
  if (result.err.find("xpected signature") != std::string::npos)
    throw JobError("{}: the chip there is {}, the image is for an {} ({}): nothing was written", port_,
                   signature, kAtmega328p.printed, kAtmega328p.signature);
  const std::string cannot_open = line_with(result.err, "cannot open port");
  if (!cannot_open.empty())
    throw JobError("{}: {}: is it still there, and has no other program it open?", port_, cannot_open);
  if (signature.empty()) return false;
  const bool reads = operation.starts_with("flash:r");
  const char* mend = reads ? "nothing was written: check cable and supply, try again"
                           : "part of it was written, the bootloader is whole: check cable and supply, then "
                             "the same once more";
  std::string mismatch = line_with(result.err, " != ");
  if (!mismatch.empty())
    throw JobError("{}: what was written reads back otherwise ({}): {}", port_, mismatch, mend);
  if (result.status > 128) throw JobError("{}: it fell silent while {}: {}", port_, what, mend);
  throw JobError("{}: {} failed while {}: {}", port_, kProgrammer, what, mend);
}

void Bootloader::run_at_any_rate(const std::string& operation, const fs::path& folder, std::size_t end) {
  const std::string tried = fmt::format(
      "{}", fmt::join(std::set<int, std::greater<>>(rates_Bd_.begin(), rates_Bd_.end()), " and "));
  while (!rates_Bd_.empty()) {
    if (rates_Bd_.front() == kOldRate_Bd && end > kOldBootloaderBegin) {
      throw JobError("{}: the image ends at 0x{:x}, an old bootloader begins at 0x{:x}: nothing was written",
                     port_, end, kOldBootloaderBegin);
    }
    if (run(operation, folder)) return;
    rates_Bd_.erase(rates_Bd_.begin());
  }
  throw JobError(
      "{}: no bootloader answers at {} baud: is it this port, is the radio unplugged from the "
      "board's RX (D0), does the board's reset reach DTR, has it a bootloader?",
      port_, tried);
}

void Bootloader::write(const FlashContent& image) {
  const io::TemporaryFolder folder;
  const fs::path hex = folder.path() / "image.hex";
  io::write_file(hex, to_intel_hex(image), io::Access::owner);
  run_at_any_rate(fmt::format("flash:w:{}:i", hex.string()), folder.path(), image.bytes.size());
}

FlashContent Bootloader::read() {
  const io::TemporaryFolder folder;
  const fs::path hex = folder.path() / "flash.hex";
  run_at_any_rate(fmt::format("flash:r:{}:i", hex.string()), folder.path(), 0);
  return read_intel_hex(hex, kAtmega328p.flash_bytes);
}

}  // namespace flexor::deploy
