// Hours of wear: a radio that fails in bursts, restarts of either board at any instant, wrong senders, strips and
// potentiometers that break. FLEXOR_SOAK_S sets how long; script/results has the figures of two hours.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "cosim/co_simulation.hpp"
#include "firmware/markers.hpp"
#include "host/deploy/deploy.hpp"
#include "host/io/io.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {
namespace {

constexpr double kSecondsPerRestart = 14.4;  // of each board: 500 in two hours

double seconds() {
  const char* asked = std::getenv("FLEXOR_SOAK_S");
  return asked != nullptr ? std::atof(asked) : 120;
}

// Fists of all fingers, now slow, now quick.
twin::TrialInput wear(const twin::Parameters& p, double length_s) {
  constexpr double kStep_s = 0.05;
  std::vector<double> t_s;
  std::array<std::vector<double>, twin::kFingers> angle;
  double phase = 0;
  for (double t = 0; t <= length_s; t += kStep_s) {
    phase += kStep_s * (0.3 + 0.25 * std::sin(0.1 * t)) * 2 * std::numbers::pi;
    t_s.push_back(t);
    for (std::size_t i = 0; i < angle.size(); ++i) {
      const double closed = 0.5 - 0.5 * std::cos(phase - 0.2 * static_cast<double>(i));
      angle[i].push_back(p.hand_lower_deg[i] + closed * (p.hand_upper_deg[i] - p.hand_lower_deg[i]));
    }
  }
  return {p, twin::Motion::from_samples("wear", t_s, angle), study::compensator("published-hw", 20).model, 1,
          false};
}

struct Wear {
  int glove_restarts = 0;
  int hand_restarts = 0;
  double longest_silence_s = 0;  // both boards on, and nothing believed
  double worst_tick_gap_ms = 0;
  int beyond_limits = 0;  // milliseconds with a set-point outside
  std::uint32_t received = 0;
};

Images build(const twin::TrialInput& input) {
  const io::TemporaryFolder folder;
  const auto glove =
      deploy::build_glove(study::glove_for(input.parameters, input.compensator), folder.path());
  const auto hand = deploy::build_hand(study::safe_hand(input.parameters, input.compensator), folder.path());
  return {Firmware(glove.elf), Firmware(hand.elf)};
}

ByteFaults bursts() {
  ByteFaults faults;
  faults.turns_bad = 0.02;
  faults.turns_good = 0.2;
  faults.bad_loss = 0.8;
  faults.bit_flip = 1e-4;
  return faults;
}

class Worn {
 public:
  explicit Worn(double length_s)
      : input_(wear(study::shipped_parameters(), length_s)),
        images_(build(input_)),
        simulation_(images_, input_, 0, bursts()) {
    simulation_.on_hand_marker = [this](Cycles now, std::uint8_t marker) { mark(now, marker); };
    simulation_.on_ms = [this](std::int64_t now) {
      if (now < on_ms_) return;
      watch(now);
      if (chance(1 / kSecondsPerRestart)) cut(simulation_.glove(), now, w_.glove_restarts);
      if (!chance(1 / kSecondsPerRestart)) return;
      cut(simulation_.hand(), now, w_.hand_restarts);
      tick_ = 0;
      received_ = 0;
    };
  }

  Wear run() {
    (void)simulation_.run();
    return w_;
  }

 private:
  bool chance(double per_s) { return std::generate_canonical<double, 32>(random_) < per_s / 1000; }

  void mark(Cycles now, std::uint8_t marker) {
    if (static_cast<firmware::Marker>(marker) != firmware::Marker::tick_begin) return;
    if (tick_ > 0)
      w_.worst_tick_gap_ms = std::max(w_.worst_tick_gap_ms, static_cast<double>(now - tick_) / kCyclesPerMs);
    tick_ = now;
  }

  void watch(std::int64_t now) {
    const HandStatus status = simulation_.hand_status();
    const twin::Parameters& p = input_.parameters;
    for (std::size_t i = 0; i < 5 && now > on_ms_ + 50 && status.link != 0; ++i) {
      w_.beyond_limits += status.setpoint[i] < std::lround(16 * p.hand_lower_deg[i]) ||
                          status.setpoint[i] > std::lround(16 * p.hand_upper_deg[i]);
    }
    const std::uint32_t all = simulation_.link_statistics().received;
    if (all != received_) heard_ms_ = now;
    if (all > received_) w_.received += all - received_;
    received_ = all;
    w_.longest_silence_s =
        std::max(w_.longest_silence_s, static_cast<double>(now - std::max(heard_ms_, on_ms_)) / 1000);
  }

  void cut(Board& board, std::int64_t now, int& restarts) {
    const int ms = 1 + static_cast<int>(random_() % 400);
    board.power_off(board.now() + static_cast<Cycles>(ms) * kCyclesPerMs);
    on_ms_ = std::max(on_ms_, now + ms + 1);
    ++restarts;
  }

  twin::TrialInput input_;
  Images images_;
  CoSimulation simulation_;
  std::mt19937 random_{7};
  Wear w_;
  std::uint32_t received_ = 0;
  std::int64_t heard_ms_ = 0;
  std::int64_t on_ms_ = 0;
  Cycles tick_ = 0;
};

TEST(Soak, NeitherRestartsNorAFailingRadioLockTheLinkOrMoveTheHandBeyondItsLimits) {
  const double length_s = seconds();
  const Wear w = Worn(length_s).run();
  std::printf(
      "%.0f s: %d restarts of the glove, %d of the hand, %u frames believed, longest silence %.1f s, worst "
      "tick gap "
      "%.2f ms\n",
      length_s, w.glove_restarts, w.hand_restarts, w.received, w.longest_silence_s, w.worst_tick_gap_ms);
  EXPECT_GT(w.glove_restarts, length_s / kSecondsPerRestart / 2);
  EXPECT_GT(w.hand_restarts, length_s / kSecondsPerRestart / 2);
  EXPECT_GT(w.received, 10 * length_s) << "of 20 a second";
  EXPECT_LT(w.longest_silence_s, 6) << "bursts of lost frames meet restarts";
  EXPECT_LT(w.worst_tick_gap_ms, 2);
  EXPECT_GT(w.worst_tick_gap_ms, 1);
  EXPECT_EQ(w.beyond_limits, 0);
}

}  // namespace
}  // namespace flexor::cosim
