// Cycles of one five-channel step on the simulated ATmega328P: plain float code, a header for own firmware, and data in the
// glove's image.
#include <fmt/format.h>

#include <cmath>

#include "cosim/compiled.hpp"
#include "cosim/replay.hpp"
#include "host/deploy/compensator_text.hpp"
#include "host/io/io.hpp"
#include "host/model/channel.hpp"

namespace {

using namespace flexor;

// As one would write it by hand: a lag for each pole, in float.
std::string plain(const model::Model& m) {
  std::string code;
  for (int i = 0; const model::Channel& c : model::channels(m)) {
    code += fmt::format("y = alpha[{}] / 32.0;\n", i);
    if (c.dead_zone)
      code += fmt::format("y = y > {0} ? y - {0} : y < {1} ? y - {1} : 0;\n", c.dead_zone->upper,
                          c.dead_zone->lower);
    code += fmt::format("y *= {};\n", c.lti.gain);
    for (std::size_t k = 0; k < c.lti.poles_rad_s.size(); ++k)
      code += fmt::format("y = x[{0}][{1}] += {2} * (y - x[{0}][{1}]);\n", i, k,
                          -std::expm1(c.lti.poles_rad_s[k] * m.sample_period_s));
    code += fmt::format("angle[{0}] = 16 * (y < {1} ? {1} : y > {2} ? {2} : y) + 0.5;\n", i++,
                        c.saturation.lower_deg, c.saturation.upper_deg);
  }
  return "struct GloveCompensator {\nint16_t alpha[5] = {};\nint16_t angle[5] = {};\nfloat x[5][3] = {};\n"
         "__attribute__((noinline)) void step() {\nfloat y;\n" +
         code + "}\n};\n";
}

// The model's own header, as `flexor export --to cpp` writes it.
std::string header(const model::Model& m) {
  return deploy::header_text(m, "own") + R"(
struct GloveCompensator {
  int16_t alpha[5] = {};
  int16_t angle[5] = {};
  own::Compensator own_;
  __attribute__((noinline)) uint8_t step() {
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
  const cosim::Firmware firmware = cosim::compiled(command);
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
    print("float, by hand", cycles_of(plain(glove.model), steps, false));
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
