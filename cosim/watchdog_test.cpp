// A program that goes round in circles, on either board: its watchdog ends that, and the hand moves again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "cosim/built_images_test.hpp"
#include "cosim/co_simulation.hpp"
#include "runtime/hand/fault.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {
namespace {

constexpr std::uint8_t kWatchdogBit = 1U << 3;  // as MCUSR, in a State
constexpr double kBackWithin_ms = 2000;

const Images& hanging_images() {
  static const Images built = built_images(between_soft_stops(published_input()));
  return built;
}

enum class Hung { glove, hand };

struct Hang {
  Hung board;
  bool interrupts;
  std::int64_t now_ms;
};

struct Aftermath {
  int bites = 0;
  double bite_after_ms = -1;  // from the hang
  double back_after_ms = -1;  // from the bite, until the hand believes a frame
  bool driven = false;        // a motor, until the hand's bite
  double limp_ms = -1;        // from the hand's bite, until a motor is driven again
  bool served = false;        // interrupts worked on between hang and bite
  bool in_state = false;
  bool in_telemetry = false;
  double moved_deg = 0;  // of all joints, once it is back
  double fastest_deg_s = 0;
  double pressed_s = 0;
};

class Hanging {
 public:
  explicit Hanging(const Hang& hang) : hang_(hang) {
    board().on_bite = [this](Cycles cycle) { bitten(cycle); };
    simulation_.on_ms = [this](std::int64_t now) { each_ms(now); };
    board().on_sample = [this, reads = board().on_sample](Cycles cycle, int pin) {
      conversions_ += hangs(static_cast<std::int64_t>(CoSimulation::time_ms(cycle))) ? 1 : 0;
      return reads ? reads(cycle, pin) : simulation_.world().potentiometer_counts(pin);
    };
    simulation_.on_air = [this](Cycles, std::uint8_t byte) { receive(glove_reader_, byte, Hung::glove); };
    simulation_.on_answer = [this](Cycles, std::uint8_t byte) { receive(hand_reader_, byte, Hung::hand); };
  }

  Aftermath run() {
    const twin::Trial trial = simulation_.run();
    out_.pressed_s = *std::ranges::max_element(trial.pressed_s);
    for (int i = 0; i < twin::kFingers; ++i) out_.moved_deg += highest_deg_[i] - lowest_deg_[i];
    return out_;
  }

 private:
  Board& board() { return hang_.board == Hung::glove ? simulation_.glove() : simulation_.hand(); }
  bool hangs(std::int64_t now) const { return now >= hang_.now_ms && !bite_; }

  void bitten(Cycles cycle) {
    ++out_.bites;
    bite_ = CoSimulation::time_ms(cycle);
    out_.bite_after_ms = *bite_ - static_cast<double>(hang_.now_ms);
    out_.served = conversions_ > 2;  // one scan's may have begun before
    if (is_driven()) out_.limp_ms = 0;
  }

  bool is_driven() {
    for (int motor = 0; motor < twin::kFingers; ++motor)
      if (simulation_.hand().duty(motor) != 0) return true;
    return false;
  }

  void each_ms(std::int64_t now) {
    if (now == hang_.now_ms) board().hang(hang_.interrupts);
    if (now < 0) return;
    for (int i = 0; i < twin::kFingers; ++i)
      out_.fastest_deg_s = std::max(out_.fastest_deg_s, std::abs(simulation_.world().speed_deg_s(i)));
    if (hangs(now)) out_.driven = is_driven();
    if (!bite_) return;
    const double since_ms = static_cast<double>(now) - *bite_;
    if (out_.limp_ms < 0 && is_driven()) out_.limp_ms = since_ms;
    if (since_ms < 3) {  // RAM is set up by then
      received_ = hang_.board == Hung::hand ? 0 : simulation_.link_statistics().received;
    } else if (out_.back_after_ms < 0 && simulation_.link_statistics().received > received_) {
      out_.back_after_ms = since_ms;
    }
    if (out_.back_after_ms < 0) return;
    for (int i = 0; i < twin::kFingers; ++i) {
      lowest_deg_[i] = std::min(lowest_deg_[i], simulation_.world().joint_deg(i));
      highest_deg_[i] = std::max(highest_deg_[i], simulation_.world().joint_deg(i));
    }
  }

  void receive(link::PacketReader& reader, std::uint8_t byte, Hung from) {
    if (reader.push(byte) != link::Received::pending || from != hang_.board) return;
    if (!bite_) return;
    if (reader.type() == link::Type::state)
      out_.in_state |= link::get_state(reader.body()).reset_cause == kWatchdogBit;
    if (reader.type() == link::Type::telemetry)
      out_.in_telemetry |= (reader.body()[2] & hand::kWatchdogReset) != 0;
  }

  Hang hang_;
  twin::TrialInput input_ = between_soft_stops(published_input());
  CoSimulation simulation_{hanging_images(), input_, 0};
  Aftermath out_;
  std::optional<double> bite_;  // ms
  int conversions_ = 0;
  std::uint32_t received_ = 0;
  link::PacketReader glove_reader_;
  link::PacketReader hand_reader_;
  double lowest_deg_[twin::kFingers] = {1e9, 1e9, 1e9, 1e9, 1e9};
  double highest_deg_[twin::kFingers] = {-1e9, -1e9, -1e9, -1e9, -1e9};
};

Aftermath of(Hung board, bool interrupts, std::int64_t now_ms) {
  const Aftermath o = Hanging({board, interrupts, now_ms}).run();
  std::printf(
      "%s at %d ms, interrupts %s: bitten after %.1f ms, limp for %.0f ms, back after %.0f ms, %.3f s "
      "pressed\n",
      board == Hung::hand ? "hand" : "glove", static_cast<int>(now_ms), interrupts ? "on" : "off",
      o.bite_after_ms, o.limp_ms, o.back_after_ms, o.pressed_s);
  EXPECT_EQ(o.bites, 1);
  EXPECT_EQ(o.served, interrupts);
  EXPECT_TRUE(o.in_state);
  EXPECT_GT(o.back_after_ms, 0) << "a frame is believed again";
  EXPECT_LT(o.back_after_ms, kBackWithin_ms);
  EXPECT_GT(o.moved_deg, 200) << "and the hand moves";
  EXPECT_LE(o.fastest_deg_s, 450);
  EXPECT_LE(o.pressed_s, 0.05);
  return o;
}

TEST(Watchdog, EndsAHandThatHangsWithItsMotorsLimp) {
  constexpr double kPeriod_ms = 32;  // 4096 cycles of 128 kHz
  constexpr double kTick_ms = 1;     // each sets it back
  for (const bool interrupts : {false, true}) {
    const Aftermath o = of(Hung::hand, interrupts, interrupts ? 3017 : 1234);
    EXPECT_LE(o.bite_after_ms, kPeriod_ms);
    EXPECT_GT(o.bite_after_ms, kPeriod_ms - 2 * kTick_ms);
    EXPECT_TRUE(o.driven) << "until then";
    EXPECT_GT(o.limp_ms, 1) << "the reset lets go; what waits for a frame goes to rest, slowly";
    EXPECT_TRUE(o.in_telemetry);
  }
}

TEST(Watchdog, EndsAGloveThatHangs) {
  constexpr double kPeriod_ms = 512;  // 65536 cycles of 128 kHz
  constexpr double kSample_ms = 50;   // each sets it back
  for (const bool interrupts : {false, true}) {
    const Aftermath o = of(Hung::glove, interrupts, interrupts ? 3017 : 1234);
    EXPECT_LE(o.bite_after_ms, kPeriod_ms);
    EXPECT_GT(o.bite_after_ms, kPeriod_ms - 2 * kSample_ms);
  }
}

}  // namespace
}  // namespace flexor::cosim
