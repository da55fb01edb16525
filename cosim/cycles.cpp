// Cycles of one five-channel step on the simulated ATmega328P: ours beside what a code generator, a matrix
// library or a plain loop over fingers makes of the same models in float. All in the same firmware, with the
// same compiler options, on the same readings.
#include <fmt/format.h>

#include <unistd.h>
#include <Eigen/Dense>

#include "cosim/replay.hpp"
#include "host/deploy/deploy.hpp"
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
  uint8_t step() {
    firmware::mark(firmware::Marker::step_begin);
    const uint8_t good = run();
    firmware::mark(firmware::Marker::step_end);
    return good;
  }
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
}}  // namespace flexor
)",
                     n);
}

// One loop over fingers, one over each finger's states.
std::string per_finger(const model::Model& m) {
  std::string rows;
  for (const model::Channel& c : model::channels(m)) {
    const StateSpace s = state_space(c, m.sample_period_s);
    const Eigen::Index n = s.b.size();
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3, 3);
    a.topLeftCorner(n, n) = s.a;
    std::string b;
    for (Eigen::Index i = 0; i < n; ++i) b += fmt::format("{:.9e}f,", s.b(i));
    rows += fmt::format("{{{}, {}, {{{}}}}},\n", n, matrix(a), b);
  }
  return "struct Filter { uint8_t n; float a[3][3]; float b[3]; };\nconst Filter kFilter[] = {" + rows +
         "};\n" + limits(m) + kFrame + R"(
  float x_[5][3] = {};
  __attribute__((noinline)) uint8_t run() {
    for (uint8_t i = 0; i < 5; ++i) {
      const Filter& f = kFilter[i];
      const float u = phi(i, alpha[i] / 32.0f);
      float next[3];
      for (uint8_t r = 0; r < f.n; ++r) {
        float sum = f.b[r] * u;
        for (uint8_t c = 0; c < f.n; ++c) sum += f.a[r][c] * x_[i][c];
        next[r] = sum;
      }
      for (uint8_t r = 0; r < f.n; ++r) x_[i][r] = next[r];
      angle[i] = out(i, x_[i][f.n - 1]);
    }
    return 31;
  }
};
}  // namespace flexor
)";
}

// Our configuration with another compensator in it.
std::string replaced(const deploy::Glove& glove, const std::string& compensator) {
  std::string config = deploy::glove_config(glove);
  config.resize(config.find("class GloveCompensator"));
  return config + compensator;
}

void compare() {
  // Readings between 440 and 839 counts: every channel takes them, and the fingers move through all of their
  // range.
  study::Counts counts = cosim::exercise(1500, 7);
  for (auto& sample : counts) {
    for (int& n : sample) n = 440 + n % 400;
  }
  const io::TemporaryFolder folder;
  fmt::print(
      "cycles of one five-channel step, ATmega328P, -Os, 10 Hz, {} steps\n\n{:<52}{:>8}{:>8}{:>10}{:>8}\n",
      counts.size(), "", "mean", "worst", "flash", "RAM");
  for (const char* name : {"published-hw", "published-w"}) {
    deploy::Glove glove = study::glove_for(study::shipped_parameters(), study::compensator(name, 10).model);
    const auto measure = [&](const char* what, const std::string& config) {
      const deploy::Image image = deploy::build_glove(config, folder.path());
      const study::GloveFigures f = cosim::replay(cosim::Firmware(image.elf), glove, counts);
      fmt::print("{:<52}{:>8.0f}{:>8}{:>10}{:>8}\n", fmt::format("{}: {}", name, what), f.step.mean(),
                 f.step.worst, image.flash_bytes, image.ram_bytes);
    };
    measure("float, dense state space", replaced(glove, dense(glove.model)));
    measure("float, loops over fingers and states", replaced(glove, per_finger(glove.model)));
    glove.assembly = false;
    measure("Flexor, portable C++", deploy::glove_config(glove));
    glove.assembly = true;
    measure("Flexor, products in assembly", deploy::glove_config(glove));
  }
  fmt::print("\nflash and RAM are of the whole glove image, radio and all\n");
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
