// Cycles of one five-channel step on the simulated ATmega328P: ours beside what a code generator, a matrix
// library makes of the same models in float, with the same compiler options; and as data in the glove's image.
#include <fmt/format.h>

#include <Eigen/Dense>

#include "cosim/compiled.hpp"
#include "cosim/replay.hpp"
#include "host/deploy/compensator_text.hpp"
#include "host/io/io.hpp"
#include "host/model/channel.hpp"
#include "host/model/discrete.hpp"

namespace {

using namespace flexor;

// x[k+1] = A x + B u, y = C x[k+1] of one finger, exact hold, gain in B.
struct StateSpace {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
};

StateSpace state_space(const model::Channel& channel, double period_s) {
  const Eigen::Index n = channel.lti.order_at(period_s);
  Eigen::VectorXd rates(n);
  for (Eigen::Index i = 0; i < n; ++i) rates(i) = -channel.lti.poles_rad_s[static_cast<std::size_t>(i)];
  const model::ZeroOrderHold hold = model::zero_order_hold(rates, period_s);
  StateSpace s{Eigen::MatrixXd::Identity(n, n), channel.lti.gain * hold.input};
  for (Eigen::Index i = 0; i < n; ++i) {
    s.a(i, i) -= hold.input(i);
    for (Eigen::Index j = 0; j < i; ++j) {
      s.a(i, j) += hold.transition(i, j);
      s.a(i, i) -= hold.transition(i, j);
    }
  }
  return s;
}

std::string matrix(const Eigen::MatrixXd& m) {
  std::string out;
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    out += "{";
    for (Eigen::Index c = 0; c < m.cols(); ++c) out += fmt::format("{:.9e}f,", m(r, c));
    out += "},";
  }
  return "{" + out + "}";
}

constexpr const char* kFrame = R"(
class GloveCompensator {
 public:
  int16_t alpha[5] = {};
  int16_t angle[5] = {};
  uint8_t step() { return run(); }

 private:
  static float phi(uint8_t i, float u) { return u > kUpper[i] ? u - kUpper[i] : u < kLower[i] ? u - kLower[i] : 0; }
  static int16_t out(uint8_t i, float y) {
    if (y < kLeast[i]) y = kLeast[i];
    if (y > kMost[i]) y = kMost[i];
    return static_cast<int16_t>(y * 16 + 0.5f);
  }
)";

std::string limits(const model::Model& m) {
  std::string lower, upper, least, most;
  for (const model::Channel& c : model::channels(m)) {
    lower += fmt::format("{}, ", c.dead_zone ? c.dead_zone->lower : 0);
    upper += fmt::format("{}, ", c.dead_zone ? c.dead_zone->upper : 0);
    least += fmt::format("{}, ", c.saturation.lower_deg);
    most += fmt::format("{}, ", c.saturation.upper_deg);
  }
  return fmt::format(
      "const float kLower[] = {{{}}};\nconst float kUpper[] = {{{}}};\nconst float kLeast[] = {{{}}};\nconst "
      "float kMost[] = {{{}}};\n",
      lower, upper, least, most);
}

// One system for all fingers, its matrices full: what a generator writes that does not look inside.
std::string dense(const model::Model& m) {
  const std::vector<model::Channel> channels = model::channels(m);
  Eigen::Index n = 0;
  for (const model::Channel& c : model::channels(m)) n += state_space(c, m.sample_period_s).b.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(n, 5);
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(5, n);
  Eigen::Index at = 0;
  for (Eigen::Index i = 0; i < 5; ++i) {
    const StateSpace s = state_space(channels[static_cast<std::size_t>(i)], m.sample_period_s);
    a.block(at, at, s.b.size(), s.b.size()) = s.a;
    b.block(at, i, s.b.size(), 1) = s.b;
    at += s.b.size();
    c(i, at - 1) = 1;
  }
  return fmt::format(
             "const float kA[{0}][{0}] = {1};\nconst float kB[{0}][5] = {2};\nconst float kC[5][{0}] = "
             "{3};\n",
             n, matrix(a), matrix(b), matrix(c)) +
         limits(m) + kFrame +
         fmt::format(R"(
  float x_[{0}] = {{}};
  __attribute__((noinline)) uint8_t run() {{
    float u[5];
    float next[{0}];
    for (uint8_t i = 0; i < 5; ++i) u[i] = phi(i, alpha[i] / 32.0f);
    for (uint8_t r = 0; r < {0}; ++r) {{
      float sum = 0;
      for (uint8_t c = 0; c < {0}; ++c) sum += kA[r][c] * x_[c];
      for (uint8_t c = 0; c < 5; ++c) sum += kB[r][c] * u[c];
      next[r] = sum;
    }}
    for (uint8_t r = 0; r < {0}; ++r) x_[r] = next[r];
    for (uint8_t i = 0; i < 5; ++i) {{
      float y = 0;
      for (uint8_t c = 0; c < {0}; ++c) y += kC[i][c] * x_[c];
      angle[i] = out(i, y);
    }}
    return 31;
  }}
}};
)",
                     n);
}

// The model's own header, as `flexor export --to cpp` writes it.
std::string header(const model::Model& m) {
  return deploy::header_text(m, "own") + limits(m) + kFrame + R"(
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
    print("float, dense state space", cycles_of(dense(glove.model), steps, true));
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
