// Hours of wear: a radio that fails in bursts, restarts of either board at any instant, wrong senders, sensors and
// potentiometers that break, supplies that dip. FLEXOR_SOAK_S sets how long, FLEXOR_SOAK_SEED which restarts and
// faults: script/soak runs two hours of it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <numbers>
#include <random>
#include <utility>

#include "cosim/built_images_test.hpp"
#include "cosim/co_simulation.hpp"
#include "cosim/radio_ear.hpp"
#include "firmware/markers.hpp"
#include "host/io/io.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {
namespace {

constexpr double kSecondsPerRestart = 14.4;  // of each board at least: 500 in two hours
constexpr double kAskedPerRestart_s = 13;    // none begins while a board is off

// Mean times between faults that begin, and how long they last.
constexpr double kSecondsPerLie = 15;
constexpr double kSecondsPerSensor = 15;
constexpr double kSecondsPerForger = 10;
constexpr double kSecondsPerForgery = 0.15;  // a frame of his: nobody may jam who wants to be received
constexpr double kSecondsPerDip = 30;
constexpr int kLongest_ms = 3000;

// How a potentiometer's reading is wrong.
enum class Lie { none, frozen, slipped_up, slipped_down, reversed, neighbour, noisy };
constexpr int kLies = 7;

constexpr int kSlip_counts = 164;  // 40 degrees

// Counts that are read: `held` were true when it began to lie, `neighbours` are true of the finger before.
int reported(Lie lie, int counts, int held, int neighbours, twin::Random& random) {
  const int lies[kLies] = {counts,
                           held,
                           counts + kSlip_counts,
                           counts - kSlip_counts,
                           2 * held - counts,
                           neighbours,
                           lie == Lie::noisy ? counts + static_cast<int>(40 * random.normal()) : counts};
  return std::clamp(lies[static_cast<int>(lie)], 0, 1023);
}

double from_environment(const char* name, double otherwise) {
  const char* asked = std::getenv(name);
  return asked != nullptr ? std::atof(asked) : otherwise;
}

// Fists of all fingers, now slow, now quick.
twin::TrialInput wear(double length_s) {
  twin::TrialInput input = between_soft_stops(published_input());
  const twin::Parameters& p = input.parameters;
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
  input.motion = twin::Motion::from_samples("wear", t_s, angle);
  return input;
}

struct Wear {
  int glove_restarts = 0;
  int hand_restarts = 0;
  int lies = 0;
  int noticed_lies = 0;
  int sensors = 0;
  int dips = 0;
  int forged = 0;  // frames of wrong senders
  int believed_of_them = 0;
  double silence_s = 0;       // longest without a believed frame, both boards on
  double good_silence_s = 0;  // and the radio in no burst of losses either way
  double worst_tick_gap_ms = 0;
  int beyond_limits = 0;     // milliseconds with a set-point outside
  int too_quick = 0;         // and with one that had moved too far within ten of them
  double fastest_deg_s = 0;  // joint
  // Against a stop; of a finger whose potentiometer reads its neighbour's, which nothing shows while both have the same command.
  int longest_press_ms = 0;
  int longest_press_floating_ms = 0;
  int impacts = 0;
  double impact_deg_s = 0;
  std::uint32_t received = 0;
};

ByteFaults bursts() {
  ByteFaults faults;
  faults.turns_bad = 0.02;
  faults.turns_good = 0.2;
  faults.bad_loss = 0.8;
  faults.bit_flip = 1e-4;
  return faults;
}

class Dice {
 public:
  // Once a millisecond.
  bool every(double seconds) { return std::generate_canonical<double, 32>(random_) < 1 / (1000 * seconds); }
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  int lasts_ms() { return 1 + below(kLongest_ms); }

 private:
  std::mt19937 random_{static_cast<std::uint32_t>(from_environment("FLEXOR_SOAK_SEED", 7))};
};

// A finger, a kind of fault, and until when.
struct Fault {
  int finger = 0;
  int kind = 0;
  std::int64_t end_ms = 0;
  bool hits(int of, std::int64_t now) const { return of == finger && now < end_ms; }
};

// Who has another key, none, or a record of the radio, and speaks to the hand.
class Forger {
 public:
  explicit Forger(CoSimulation& simulation)
      : simulation_(simulation), wrong_(study::bench_key()), ear_(other()) {
    simulation.on_answer = [this](Cycles, std::uint8_t byte) { ear_.hand_sent(byte); };
    simulation.on_air = [this](Cycles, std::uint8_t byte) { record(byte); };
  }

  // One frame; its kind: another key, none, a replay, rubbish.
  void speak(int kind) {
    link::Frame frame{};
    for (auto& angle : frame.angle) angle = 113 * 16;
    frame.counter = ++counter_;
    std::vector<std::uint8_t> wire(24, 0x55);
    if (kind == 3) return simulation_.inject(wire);
    wire.resize(link::kMaxWire);
    if (kind == 0) wire.resize(link::encode(frame, true, ear_.session_key(), wire.data()));
    if (kind == 1) wire.resize(link::encode(frame, true, nullptr, wire.data()));
    if (kind == 2 && frames_.size() < kKept) return;
    if (kind == 2) wire = frames_.front();
    simulation_.inject(wire);
  }

 private:
  static constexpr std::size_t kKept =
      60;  // frames, three seconds: their challenge is an old one, or their counter
  const deploy::Key& other() {
    wrong_->bytes[3] ^= 1;
    return wrong_;
  }
  void record(std::uint8_t byte) {
    now_.push_back(byte);
    if (byte != link::kDelimiter) return;
    if (now_.size() > 1) frames_.push_back(now_);  // a frame begins with a delimiter, too
    now_.clear();
    if (frames_.size() > kKept) frames_.pop_front();
  }

  CoSimulation& simulation_;
  deploy::Key wrong_;
  RadioEar ear_;
  std::uint32_t counter_ = 0;
  std::vector<std::uint8_t> now_;
  std::deque<std::vector<std::uint8_t>> frames_;
};

class Worn {
 public:
  explicit Worn(double length_s)
      : input_(wear(length_s)),
        images_(built_images(input_)),
        simulation_(images_, input_, 0, bursts()),
        forger_(simulation_) {
    simulation_.on_hand_marker = [this](Cycles now, std::uint8_t marker) { mark(now, marker); };
    simulation_.on_potentiometer = [this](std::int64_t now, int finger, int counts) {
      return potentiometer(now, finger, counts);
    };
    simulation_.on_reading = [this](std::int64_t now, int finger, int counts) {
      constexpr int kBroken[] = {1023, 0, 700};  // open, short, stuck
      return sensor_.hits(finger, now) ? kBroken[sensor_.kind] : counts;
    };
    simulation_.on_ms = [this](std::int64_t now) { step(now); };
  }

  Wear run() {
    const twin::Trial trial = simulation_.run();
    for (const int n : trial.impacts) w_.impacts += n;
    w_.impact_deg_s = *std::ranges::max_element(trial.impact_deg_s);
    return w_;
  }

 private:
  static constexpr std::size_t kWindow_ms = 10;
  static constexpr double kSetpoint_deg_s = 400;

  void step(std::int64_t now) {
    if (now > 0 && now % 600'000 == 0)
      std::fprintf(stderr, "soak: %lld simulated minutes\n", static_cast<long long>(now / 60'000));
    watch_joints();
    if (now >= hand_on_ms_) receive(now);
    if (now < on_ms_) return;
    watch_setpoints(now);
    watch_silence(now);
    begin_faults(now);
    if (dice_.every(kAskedPerRestart_s)) cut(simulation_.glove(), now, w_.glove_restarts);
    if (!dice_.every(kAskedPerRestart_s)) return;
    cut(simulation_.hand(), now, w_.hand_restarts);
    hand_on_ms_ = on_ms_;
    tick_ = 0;
    received_ = 0;
  }

  void begin_faults(std::int64_t now) {
    if (now >= lie_.end_ms && dice_.every(kSecondsPerLie)) {
      lie_ = {dice_.below(twin::kFingers), 1 + dice_.below(kLies - 1), now + dice_.lasts_ms()};
      held_ = simulation_.world().potentiometer_counts(lie_.finger);
      is_noticed_ = false;
      ++w_.lies;
    }
    if (now >= sensor_.end_ms && dice_.every(kSecondsPerSensor)) {
      sensor_ = {dice_.below(twin::kFingers), dice_.below(3), now + dice_.lasts_ms()};
      ++w_.sensors;
    }
    if (now >= forged_until_ms_ && dice_.every(kSecondsPerForger)) {
      forges_ = dice_.below(4);
      forged_until_ms_ = now + dice_.lasts_ms();
      simulation_.radio_on = dice_.below(2) == 0;
      blocked_ms_ = now;
    }
    if (now >= forged_until_ms_) simulation_.radio_on = true;
    if (now < forged_until_ms_ && dice_.every(kSecondsPerForgery)) {
      forger_.speak(forges_);
      ++w_.forged;
    }
    if (now == dip_end_ms_) simulation_.hand().set_supply(5000);
    if (now <= dip_end_ms_ || !dice_.every(kSecondsPerDip)) return;
    dip_end_ms_ = now + 1 + dice_.below(300);
    simulation_.hand().set_supply(4200);
    ++w_.dips;
  }

  int potentiometer(std::int64_t now, int finger, int counts) {
    if (!lie_.hits(finger, now)) return counts;
    const int neighbour = finger > 0 ? finger - 1 : finger + 1;
    return reported(static_cast<Lie>(lie_.kind), counts, held_,
                    simulation_.world().potentiometer_counts(neighbour), noise_);
  }

  void mark(Cycles now, std::uint8_t marker) {
    if (static_cast<firmware::Marker>(marker) != firmware::Marker::tick_begin) return;
    if (tick_ > 0)
      w_.worst_tick_gap_ms = std::max(w_.worst_tick_gap_ms, static_cast<double>(now - tick_) / kCyclesPerMs);
    tick_ = now;
  }

  void watch_joints() {
    const twin::World& world = simulation_.world();
    for (int i = 0; i < twin::kFingers; ++i) {
      const auto f = static_cast<std::size_t>(i);
      w_.fastest_deg_s = std::max(w_.fastest_deg_s, std::abs(world.speed_deg_s(i)));
      press_ms_[f] = world.pressed_ms(i) > pressed_ms_[f] ? press_ms_[f] + 1 : 0;
      pressed_ms_[f] = world.pressed_ms(i);
      const bool floats = lie_.finger == i && static_cast<Lie>(lie_.kind) == Lie::neighbour;
      int& longest_ms = floats ? w_.longest_press_floating_ms : w_.longest_press_ms;
      longest_ms = std::max(longest_ms, press_ms_[f]);
    }
  }

  void watch_setpoints(std::int64_t now) {
    const HandStatus status = simulation_.hand_status();
    const twin::Parameters& p = input_.parameters;
    for (std::size_t i = 0; i < setpoints_.size(); ++i) {
      if (lie_.hits(static_cast<int>(i), now) && status.fault[i] != 0 && !std::exchange(is_noticed_, true))
        ++w_.noticed_lies;
      std::deque<int>& past = setpoints_[i];
      // A finger that was limp begins again where it is.
      const bool drives = now > on_ms_ + 50 && status.link != 0 && status.board == 0 && status.fault[i] < 2;
      // What is looked at may be a tick that has cleared the fault and not yet set the set-point.
      const bool begins = drives && !drove_[i];
      drove_[i] = drives;
      if (!drives || begins) past.clear();
      if (!drives || begins) continue;
      const int at = status.setpoint[i];
      w_.beyond_limits +=
          at < std::lround(16 * p.hand_lower_deg[i]) || at > std::lround(16 * p.hand_upper_deg[i]);
      // A tick that waits for a tag may fall into the next millisecond: one more of them in ten.
      if (past.size() == kWindow_ms) {
        w_.too_quick += std::abs(at - past.front()) > 16 * kSetpoint_deg_s / 1000 * (kWindow_ms + 1) + 1;
        past.pop_front();
      }
      past.push_back(at);
    }
  }

  void receive(std::int64_t now) {
    const std::uint32_t all = simulation_.link_statistics().received;
    if (all > received_) {
      w_.received += all - received_;
      received_ms_ = now;
      // A frame that was on its way is believed within so many; three tags are computed for the first of a session.
      constexpr int kLate_ms = 60;
      if (!simulation_.radio_on) w_.believed_of_them += now - blocked_ms_ > kLate_ms;
    }
    received_ = all;
  }

  void watch_silence(std::int64_t now) {
    if (!simulation_.both_ways_are_good()) burst_ms_ = now;
    if (!simulation_.radio_on) radio_off_ms_ = now;
    const std::int64_t since_ms = std::max({received_ms_, on_ms_, radio_off_ms_});
    const auto silence_s = [&](std::int64_t from_ms) { return static_cast<double>(now - from_ms) / 1000; };
    w_.silence_s = std::max(w_.silence_s, silence_s(since_ms));
    w_.good_silence_s = std::max(w_.good_silence_s, silence_s(std::max(since_ms, burst_ms_)));
  }

  void cut(Board& board, std::int64_t now, int& restarts) {
    const int ms = 1 + dice_.below(400);
    board.power_off(board.now() + static_cast<Cycles>(ms) * kCyclesPerMs);
    on_ms_ = std::max(on_ms_, now + ms + 1);
    for (auto& past : setpoints_) past.clear();
    ++restarts;
  }

  twin::TrialInput input_;
  Images images_;
  CoSimulation simulation_;
  Forger forger_;
  Dice dice_;
  twin::Random noise_{7};
  Wear w_;
  Fault lie_;
  int held_ = 0;  // counts
  bool is_noticed_ = false;
  Fault sensor_;
  int forges_ = 0;  // kind
  std::int64_t forged_until_ms_ = 0;
  std::int64_t dip_end_ms_ = 0;
  std::array<std::deque<int>, twin::kFingers> setpoints_;
  std::array<bool, twin::kFingers> drove_{};
  std::array<int, twin::kFingers> pressed_ms_{};
  std::array<int, twin::kFingers> press_ms_{};  // at a stretch
  std::uint32_t received_ = 0;
  std::int64_t received_ms_ = 0;
  std::int64_t blocked_ms_ = 0;  // since when nobody but the wrong sender is received
  std::int64_t burst_ms_ = 0;
  std::int64_t radio_off_ms_ = 0;
  std::int64_t on_ms_ = 0;  // both boards
  std::int64_t hand_on_ms_ = 0;
  Cycles tick_ = 0;
};

void print(double length_s, const Wear& w) {
  std::printf(
      "in %.0f s: %d restarts of the glove, %d of the hand, %d lying potentiometers, of which noticed %d, %d "
      "broken sensors, %d dips\n",
      length_s, w.glove_restarts, w.hand_restarts, w.lies, w.noticed_lies, w.sensors, w.dips);
  std::printf("frames believed          %u, %.1f a second\n", w.received, w.received / length_s);
  std::printf("frames of wrong senders  %d, of which believed %d\n", w.forged, w.believed_of_them);
  std::printf("longest silence          %.2f s of a radio that works, %.2f s with its bursts\n",
              w.good_silence_s, w.silence_s);
  std::printf("worst tick gap           %.2f ms\n", w.worst_tick_gap_ms);
  std::printf("set-points               %d ms outside their limits, %d too quick\n", w.beyond_limits,
              w.too_quick);
  std::printf("joints                   at most %.0f deg/s\n", w.fastest_deg_s);
  std::printf(
      "end stops                %d impacts at up to %.0f deg/s, pressed for at most %d ms, floating %d ms\n",
      w.impacts, w.impact_deg_s, w.longest_press_ms, w.longest_press_floating_ms);
}

TEST(Soak, NeitherRestartsNorAFailingRadioLockTheLinkOrMoveTheHandBeyondItsLimits) {
  const double length_s = from_environment("FLEXOR_SOAK_S", 120);
  const Wear w = Worn(length_s).run();
  print(length_s, w);
  EXPECT_GE(w.glove_restarts, std::floor(length_s / kSecondsPerRestart));
  EXPECT_GE(w.hand_restarts, std::floor(length_s / kSecondsPerRestart));
  EXPECT_GT(w.lies, length_s / kSecondsPerLie / 3);
  EXPECT_GT(w.noticed_lies, 0.8 * w.lies) << "the others are short, or do nothing";
  EXPECT_GT(w.sensors, length_s / kSecondsPerSensor / 3);
  EXPECT_GT(w.dips, length_s / kSecondsPerDip / 3);
  EXPECT_GT(w.forged, length_s / 4);
  EXPECT_EQ(w.believed_of_them, 0);
  EXPECT_GT(w.received, 10 * length_s) << "of 20 a second";
  EXPECT_LT(w.good_silence_s, 2) << "of a radio that works between two boards that run";
  EXPECT_LT(w.silence_s, 6) << "bursts of lost frames meet restarts";
  EXPECT_LT(w.worst_tick_gap_ms, 2);
  EXPECT_GT(w.worst_tick_gap_ms, 1);
  EXPECT_EQ(w.beyond_limits, 0);
  EXPECT_EQ(w.too_quick, 0);
  EXPECT_LE(w.fastest_deg_s, 450);
  EXPECT_LE(w.longest_press_ms, 50) << "as in protection_test";
  EXPECT_LE(w.longest_press_floating_ms, 80) << "as in runtime/hand/README.md";
}

}  // namespace
}  // namespace flexor::cosim
