// Cycles of one five-channel step on the simulated ATmega328P: as a header for own firmware, and as data in the glove's image.
#include <fmt/format.h>

#include "cosim/compiled.hpp"
#include "cosim/replay.hpp"
#include "host/deploy/compensator_text.hpp"
#include "host/io/io.hpp"

namespace {

using namespace flexor;

// The model's own header, as `flexor export --to cpp` writes it.
std::string header(const model::Model& m) {
  return deploy::header_text(m, "own") + R"(
struct GloveCompensator {
  int16_t alpha[5] = {};
  int16_t angle[5] = {};
  uint8_t step() { return run(); }
  own::Compensator own_;
  __attribute__((noinline)) uint8_t run() {
    for (uint8_t i = 0; i < 5; ++i) own_.alpha[i] = alpha[i];
    const uint8_t good = own_.step();
    for (uint8_t i = 0; i < 5; ++i) angle[i] = own_.angle[i];
    return good;
  }
};
)";
}

// Steps of a program of nothing else, readings all over the range that every finger takes.
deploy::CycleStatistic cycles_of(const std::string& compensator, int steps, bool assembly) {
  const io::TemporaryFolder folder;
  const std::string program = folder.path() / "program.cpp";
  io::write_file(program,
                 "#include <avr/io.h>\n#include <avr/pgmspace.h>\n#include <stdint.h>\n" + compensator + R"(
GloveCompensator one;
int main() {
  for (uint16_t k = 0;; ++k) {
    for (uint8_t i = 0; i < 5; ++i) one.alpha[i] = static_cast<int16_t>(32 * (20 + (7 * k + 13 * i) % 120));
    GPIOR0 = 1;
    one.step();
    GPIOR0 = 2;
  }
}
)");
  std::vector<std::string> command = {"avr-g++",    "-mmcu=atmega328p", "-Os",
                                      "-std=c++14", "-fno-exceptions",  program};
  if (assembly) command.emplace_back("-DFLEXOR_AVR_ASSEMBLY");
  const cosim::Firmware firmware = cosim::compiled(command).firmware();
  cosim::Board board(firmware);
  deploy::CycleStatistic out;
  cosim::Cycles begin = 0;
  int seen = 0;
  board.on_marker = [&](cosim::Cycles now, std::uint8_t value) {
    if (value == 2 && ++seen > 1) out.add(now - begin - 2);  // "ldi, out" of the closing marker
    begin = now;
  };
  while (seen <= steps) board.run_until(board.now() + cosim::kCyclesPerMs);
  return out;
}

void compare() {
  // Readings between 440 and 839 counts: every channel takes them, and the fingers move through all of their
  // range.
  study::Counts counts = cosim::exercise(1500, 7);
  for (auto& sample : counts) {
    for (int& n : sample) n = 440 + n % 400;
  }
  fmt::print("cycles of one five-channel step, ATmega328P, -Os, 10 Hz, {} steps\n\n{:<52}{:>8}{:>8}\n",
             counts.size(), "", "mean", "worst");
  for (const char* name : {"published-hw", "published-w"}) {
    const deploy::Glove glove = deploy::glove_for({}, study::compensator(name, 10).model, study::bench_key());
    const auto print = [&](const char* what, const deploy::CycleStatistic& cycles) {
      fmt::print("{:<52}{:>8.0f}{:>8}\n", fmt::format("{}: {}", name, what), cycles.mean(), cycles.worst);
    };
    const int steps = static_cast<int>(counts.size());
    print("Flexor, a header in portable C++", cycles_of(header(glove.model), steps, false));
    print("Flexor, a header with products in assembly", cycles_of(header(glove.model), steps, true));
    print("Flexor, data", cosim::replay(glove, counts).step);
  }
}

}  // namespace

int main() {
  try {
    compare();
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "avr_cycles: {}\n", error.what());
    return 1;
  }
}
