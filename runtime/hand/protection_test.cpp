// A finger on a motor of which everything is known, between stops that give: what a lying potentiometer, a held
// finger and an honest hand come to.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>

#include "runtime/hand/finger.hpp"

namespace flexor::hand {
namespace {

// The twin's motor behind its gear, in shares of the supply and degrees a second.
constexpr double kFullSpeed_deg_s = 1163;
constexpr double kTime_s = 0.0132;
constexpr double kFriction = 0.051;  // of full duty
constexpr double kLoad = 0.0426;     // the greatest
constexpr double kLower_deg = 28;    // the stops
constexpr double kUpper_deg = 113;
constexpr double kStopDuty_per_deg = 0.4;  // what a stop pushes back with
constexpr double kPressing = 0.1;          // as in host/twin
constexpr double kTop_deg_s = 450;
constexpr int kLongest_ms = 50;

std::int16_t duty_of(double share) { return static_cast<std::int16_t>(std::lround(share * kFullDuty)); }
std::int32_t in_a_tick(double deg_s) { return static_cast<std::int32_t>(deg_s / 1000 * (1 << 20)); }

FingerSettings elastic_settings(bool watched = true) {
  FingerSettings c{};
  c.loop = {30 * 16,        111 * 16, in_a_tick(400),
            duty_of(0.05),  1057,     static_cast<std::int32_t>(kFullDuty) << 6,
            duty_of(0.317), 25736};        // 440 degrees a second of the fastest motor that is accepted
  c.potentiometer = {256250, 0, 61, 524};  // 250 degrees over 1023 counts
  c.careful_step = in_a_tick(150);
  const auto speed = [](double deg_s) {
    return static_cast<std::int16_t>(std::lround(deg_s / 1000 * kTurn_ticks * (1 << kSumFraction)));
  };
  const double rate = -std::expm1(-0.001 * kTurn_ticks / kTime_s);
  c.motor.rate = watched ? static_cast<std::int16_t>(std::lround(rate * 65536)) : 0;
  c.motor.gain =
      static_cast<std::int16_t>(std::lround(rate * kFullSpeed_deg_s / 1000 * kTurn_ticks * (1 << 14)));
  c.motor.friction = speed(kFriction * kFullSpeed_deg_s);
  c.motor.load = speed(0.067 * kFullSpeed_deg_s);
  c.motor.forget = speed(4);
  c.motor.gap = static_cast<std::int16_t>(1.25 * (1 << kSumFraction));
  c.motor.breakaway = duty_of(0.09);
  c.motor.kick = duty_of(0.3);
  return c;
}

struct Motor {
  double full_speed_deg_s = kFullSpeed_deg_s;
  double friction = kFriction;
  double angle_deg = 70;
  double speed_deg_s = 0;
  double load = 0;  // share of the supply
  double wall_deg = 1e9;
  double wall_duty_per_deg = kStopDuty_per_deg;
  double fastest_deg_s = 0;
  int impacts = 0;
  int pressed_ms = 0;
  int lain_ms = 0;  // with half of that duty
  bool touching = false;

  void step(std::int16_t duty_now) {
    const double u = static_cast<double>(duty_now) / kFullDuty;
    const double past = angle_deg - std::clamp(angle_deg, kLower_deg, std::min(kUpper_deg, wall_deg));
    const double rate = 0.001 / (kTime_s + 0.001);
    const double pushed =
        speed_deg_s + ((u + load - (angle_deg > wall_deg ? wall_duty_per_deg : kStopDuty_per_deg) * past) *
                           full_speed_deg_s -
                       speed_deg_s) *
                          rate;
    const double dry = friction * full_speed_deg_s * rate;
    speed_deg_s = pushed - std::clamp(pushed, -dry, dry);
    angle_deg += speed_deg_s / 1000;
    fastest_deg_s = std::max(fastest_deg_s, std::abs(speed_deg_s));
    const double upper = std::min(kUpper_deg, wall_deg);
    const bool now = angle_deg <= kLower_deg || angle_deg >= upper;
    impacts += now && !touching;
    touching = now;
    const bool towards = angle_deg <= kLower_deg ? u < 0 : u > 0;
    pressed_ms += now && towards && std::abs(u) >= kPressing;
    lain_ms += now && towards && std::abs(u) >= kPressing / 2;
  }
};

enum class Lie {
  none,
  frozen,
  slipped,
  slips,
  reversed,
  neighbour,
  noisy,
  half,
  lags,
  creeps,
  wanders,
  sticks
};
constexpr double kSlipSpeed_deg_s = 20;  // of what slips slowly
constexpr double kCreep_deg_s = 83;      // with the command
constexpr double kStick_deg = 3;

// How, where the lie needs it.
struct Shape {
  double noise_deg = 0;  // of Lie::noisy
  double slip_deg = 40;  // below 0: down
  double factor = 1;     // of a neighbour's reading, and what is added
  int offset_counts = 0;
  double lag_ms = 80;
  double wander_deg = 0;
  double wander_Hz = 0;
};

// Two fingers, of which the first one's potentiometer may lie.
struct ElasticBench {
  FingerSettings c = elastic_settings();
  std::mt19937_64 random{1};
  std::array<Finger, 2> finger;
  std::array<Motor, 2> motor;
  NeighbourWatch neighbours;
  LinkWatch link;
  Lie lie = Lie::none;
  double lie_from_deg = 0;
  Shape how;
  double honest_noise_deg = 0.15;
  double lagging_deg = 0;
  std::size_t second = 1;             // in the order of the scan
  std::optional<std::int16_t> stuck;  // what the first one's driver gives
  int lied_ms = 0;
  int noticed_ms = -1;
  int faults = 0;
  int now_ms = 0;

  double normal() { return std::normal_distribution<double>()(random); }
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); }
  static std::uint16_t counts(double deg) {
    return static_cast<std::uint16_t>(std::clamp(std::lround(deg * 1023 / 250), 0L, 1023L));
  }
  void begin(Lie now) {
    lie = now;
    lagging_deg = lie_from_deg = motor[0].angle_deg;
  }
  // What the first one's potentiometer reads instead of its angle, degrees.
  double lie_deg(double command_deg) {
    const double at_deg = motor[0].angle_deg;
    const double slowly_deg = lied_ms * kSlipSpeed_deg_s / 1000;
    if (lie == Lie::lags) lagging_deg += (at_deg - lagging_deg) / how.lag_ms;
    if (lie == Lie::creeps)
      lagging_deg += std::clamp(command_deg - lagging_deg, -kCreep_deg_s / 1000, kCreep_deg_s / 1000);
    if (lie == Lie::sticks && std::abs(at_deg - lagging_deg) > kStick_deg) lagging_deg = at_deg;
    if (lie == Lie::lags || lie == Lie::creeps || lie == Lie::sticks) return lagging_deg;
    if (lie == Lie::slipped) return at_deg + how.slip_deg;
    if (lie == Lie::slips) return at_deg + std::clamp(how.slip_deg, -slowly_deg, slowly_deg);
    if (lie == Lie::reversed) return 2 * lie_from_deg - at_deg;
    if (lie == Lie::half) return (lie_from_deg + at_deg) / 2;
    if (lie == Lie::noisy) return at_deg + how.noise_deg * normal();
    if (lie != Lie::wanders) return at_deg;
    return at_deg + how.wander_deg * std::sin(2 * 3.14159 * how.wander_Hz * lied_ms / 1000);
  }
  std::array<std::uint16_t, 2> readings(double command_deg) {
    std::array<std::uint16_t, 2> out{};
    for (std::size_t i = 0; i < 2; ++i)
      out[i] = counts((i == 0 ? lie_deg(command_deg) : motor[1].angle_deg) + honest_noise_deg * normal());
    if (lie == Lie::frozen) out[0] = counts(lie_from_deg);
    if (lie == Lie::neighbour)
      out[0] = static_cast<std::uint16_t>(
          std::clamp(std::lround(out[1] * how.factor) + how.offset_counts, 0L, 1023L));
    return out;
  }
  // The article's disturbance: slow, and bounded.
  void change_loads() {
    for (Motor& m : motor) m.load = std::clamp(0.905 * m.load + 0.425 * kLoad / 2 * normal(), -kLoad, kLoad);
  }
  void tick(std::array<double, 2> command_deg) {
    if (now_ms++ % 100 == 0) change_loads();
    link.frame();
    (void)link.tick();
    const auto reading = readings(command_deg[0]);
    const std::size_t first = 1 - second;
    if (now_ms % NeighbourWatch::kWindow_ms == 0)
      neighbours.look(reading[first], reading[second],
                      static_cast<std::int16_t>(finger[second].setpoint() - finger[first].setpoint()),
                      now_ms / NeighbourWatch::kWindow_ms % 2 == 0);
    for (std::size_t i = 0; i < 2; ++i) {
      const auto command = static_cast<std::int16_t>(std::lround(16 * command_deg[i]));
      const Fault before = finger[i].fault();
      const std::int16_t now = finger[i].tick(c, Link::following, command, 30 * 16, reading[i],
                                              (now_ms + static_cast<int>(i)) % kTurn_ticks == 0,
                                              i == second ? neighbours.of_second() : Neighbour{});
      faults += before == Fault::none && finger[i].fault() != Fault::none;
      motor[i].step(i == 0 && stuck ? *stuck : now);
    }
    if (lie != Lie::none && noticed_ms < 0 && finger[0].fault() != Fault::none) noticed_ms = lied_ms;
    lied_ms += lie != Lie::none;
  }
};

// A hand's commands: gestures between poses at the article's speed, steps, slow drifts, a shaking hand.
struct Commands {
  explicit Commands(std::uint64_t seed) : random(seed) {}
  std::mt19937_64 random;
  double goal = 70;
  double at = 70;
  double speed = 83;
  double hold = 0;
  double shake = 0;
  double phase = 0;
  double next() {
    std::uniform_real_distribution<double> u(0, 1);
    if (hold <= 0) {
      const double kind = u(random);
      goal = kind < 0.3 ? 20 : kind < 0.6 ? 120 : 25 + 95 * u(random);
      const double speeds[] = {5, 20, 83, 83, 83, 300, 1e6};
      speed = speeds[static_cast<int>(7 * u(random))];
      shake = u(random) < 0.5 ? 0 : 1.5 * u(random);
      hold = 200 + 2000 * u(random);
    }
    --hold;
    at += std::clamp(goal - at, -speed / 1000, speed / 1000);
    phase += 2 * 3.14159 * 4.5 / 1000;
    return at + shake * std::sin(phase);
  }
};

struct Case {
  const char* name;
  Lie lie;
  int unguarded_ms;  // of pressing, at least, in the worst run without the watch
  Shape how = {};
  double noticed = 0.97;         // of all runs
  int longest_ms = kLongest_ms;  // more than kLongest_ms in one run of a hundred: README.md
  int lain_ms = 2400;            // of six seconds, with half of that duty: README.md
};

struct Kind {  // of motor, as shares of the assumed values
  double speed = 1;
  double friction = 1;
};

struct Outcome {
  double fastest_deg_s = 0;
  int pressed_ms = 0;
  int lain_ms = 0;
  int beyond = 0;  // runs that pressed for longer than kLongest_ms
  int noticed = 0;
  int runs = 0;
};

// The first finger's potentiometer begins to lie at a random instant, and lies for six seconds. `together`: both
// fingers have the same command.
void lie_to(const Case& lies, std::uint64_t seed, bool together, bool watched, Kind kind, Outcome& out) {
  ElasticBench bench;
  bench.c = elastic_settings(watched);
  bench.random.seed(seed);
  bench.how = lies.how;
  bench.second = seed % 2;
  Commands one(seed * 2 + 1);
  Commands two(together ? seed * 2 + 1 : seed * 2 + 2);
  for (Motor& m : bench.motor) {
    m.angle_deg = bench.uniform(31, 110);
    m.full_speed_deg_s *= kind.speed;
    m.friction *= kind.friction;
  }
  if (together) bench.motor[1].angle_deg = bench.motor[0].angle_deg;
  const int onset_ms = static_cast<int>(bench.uniform(500, 5000));
  for (int ms = 0; ms < onset_ms + 6000; ++ms) {
    if (ms == onset_ms) bench.begin(lies.lie);
    bench.tick({one.next(), two.next()});
  }
  out.fastest_deg_s = std::max(out.fastest_deg_s, bench.motor[0].fastest_deg_s);
  out.pressed_ms = std::max(out.pressed_ms, bench.motor[0].pressed_ms);
  out.lain_ms = std::max(out.lain_ms, bench.motor[0].lain_ms);
  out.beyond += bench.motor[0].pressed_ms > kLongest_ms;
  out.noticed += bench.noticed_ms >= 0;
  ++out.runs;
}

class Lies : public testing::TestWithParam<Case> {};

TEST_P(Lies, AreNoticedAndNeitherSpeedNorPressingGoesBeyondItsBound) {
  Outcome out;
  for (std::uint64_t seed = 1; seed <= 150; ++seed)
    for (const bool together : {false, true}) lie_to(GetParam(), seed, together, true, {}, out);
  EXPECT_LE(out.fastest_deg_s, kTop_deg_s);
  EXPECT_GT(out.fastest_deg_s, 200) << "it does move";
  EXPECT_LE(out.pressed_ms, GetParam().longest_ms);
  EXPECT_LE(out.lain_ms, GetParam().lain_ms);
  EXPECT_LE(out.beyond, out.runs / 100);
  EXPECT_GE(out.noticed, out.runs * GetParam().noticed)
      << "the rest did nothing within six seconds that could show it";
}

TEST_P(Lies, DoNoWorseToAnyMotorThatIsAccepted) {
  Outcome out;
  for (const double speed : {0.85, 1.15}) {
    for (const double friction : {0.6, 1.4}) {
      for (std::uint64_t seed = 1; seed <= 15; ++seed) {
        for (const bool together : {false, true})
          lie_to(GetParam(), seed, together, true, {speed, friction}, out);
      }
    }
  }
  EXPECT_LE(out.fastest_deg_s, kTop_deg_s);
  EXPECT_LE(out.pressed_ms, GetParam().longest_ms);
  EXPECT_LE(out.lain_ms, GetParam().lain_ms);
  EXPECT_LE(out.beyond, out.runs / 100);
}

TEST_P(Lies, PressOnWithoutTheWatch) {
  if (GetParam().unguarded_ms == 0) GTEST_SKIP() << "it presses little without the watch, too";
  Outcome out;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) lie_to(GetParam(), seed, false, false, {}, out);
  EXPECT_GE(out.pressed_ms, GetParam().unguarded_ms);
}

INSTANTIATE_TEST_SUITE_P(
    Protection, Lies,
    testing::Values(
        Case{"frozen", Lie::frozen, 2000}, Case{"slipped_up", Lie::slipped, 2000},
        Case{"slipped_down", Lie::slipped, 2000, {.slip_deg = -40}},
        Case{"slipped_up_9", Lie::slipped, 500, {.slip_deg = 9}},
        Case{"slipped_down_9", Lie::slipped, 500, {.slip_deg = -9}},
        Case{"slips_up", Lie::slips, 500, {}, 0.8},
        Case{"slips_down", Lie::slips, 500, {.slip_deg = -40}, 0.8},
        Case{.name = "half", .lie = Lie::half, .unguarded_ms = 500, .noticed = 0.9, .longest_ms = 60},
        Case{.name = "lags", .lie = Lie::lags, .unguarded_ms = 0, .longest_ms = 80},
        Case{"reversed", Lie::reversed, 2000},
        Case{.name = "neighbour", .lie = Lie::neighbour, .unguarded_ms = 2000, .longest_ms = 80},
        Case{"neighbour_and_5", Lie::neighbour, 2000, {.offset_counts = 5}, 0.97, 80},
        Case{"neighbour_less_5", Lie::neighbour, 2000, {.offset_counts = -5}, 0.97, 80},
        Case{"nearly_neighbour", Lie::neighbour, 2000, {.factor = 0.97}, 0.97, 80},
        Case{"half_neighbour", Lie::neighbour, 2000, {.factor = 0.5}},
        Case{.name = "lags_400", .lie = Lie::lags, .unguarded_ms = 0, .how = {.lag_ms = 400}, .lain_ms = 600},
        Case{.name = "sticks", .lie = Lie::sticks, .unguarded_ms = 0},
        Case{.name = "creeps", .lie = Lie::creeps, .unguarded_ms = 500, .longest_ms = 70},
        Case{"wanders_10_at_2_Hz", Lie::wanders, 50, {.wander_deg = 10, .wander_Hz = 2}},
        Case{"wanders_10_at_4_Hz", Lie::wanders, 50, {.wander_deg = 10, .wander_Hz = 4}},
        Case{"wanders_40_at_half_a_Hz", Lie::wanders, 500, {.wander_deg = 40, .wander_Hz = 0.5}},
        Case{"noise_of_2", Lie::noisy, 0, {2}}, Case{"noise_of_10", Lie::noisy, 0, {10}},
        Case{"noise_of_60", Lie::noisy, 0, {60}}),
    [](const auto& one) { return one.param.name; });

// Its motor gets the whole supply whatever its duty, from a random instant on, until the drivers are switched off.
TEST(Protection, ADriverThatSticksIsSwitchedOffSoonAndAnHonestHandNever) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    ElasticBench bench;
    bench.random.seed(seed);
    Commands commands(seed);
    Motor& m = bench.motor[0];
    m.angle_deg = bench.uniform(31, 110);
    bool off = false;
    for (int ms = 0; ms < 3000; ++ms) {
      bench.tick({commands.next(), 60});
      ASSERT_FALSE(bench.finger[0].runs_away() || bench.finger[1].runs_away()) << seed;
    }
    const std::int16_t stuck = seed % 2 == 0 ? kFullDuty : -kFullDuty;
    for (int ms = 0; ms < 1000; ++ms) {
      bench.stuck = off ? std::int16_t{0} : stuck;
      bench.tick({commands.next(), 60});
      off = off || bench.finger[0].runs_away();
    }
    EXPECT_TRUE(off) << seed;
    EXPECT_LE(m.pressed_ms, kLongest_ms) << seed;
  }
}

// A slip from before the start: nothing jumps. Each time that it comes to a stop, it gives up there.
TEST(Protection, ASlipThatNobodySawPressesOnlyBrieflyEachTime) {
  for (const double slip_deg : {40., -40.}) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      ElasticBench bench;
      bench.random.seed(seed);
      bench.how.slip_deg = slip_deg;
      bench.begin(Lie::slipped);
      Commands commands(seed);
      for (Motor& m : bench.motor) m.angle_deg = 70 - slip_deg / 2;
      int since_free_ms = 0;
      for (int ms = 0; ms < 10000; ++ms) {
        const int before = bench.motor[0].pressed_ms;
        const double command = commands.next();
        bench.tick({command, command});
        if (!bench.motor[0].touching) since_free_ms = 0;
        since_free_ms += bench.motor[0].pressed_ms - before;
        ASSERT_LE(since_free_ms, kLongest_ms) << seed << ' ' << ms;
      }
      EXPECT_LE(bench.motor[0].fastest_deg_s, kTop_deg_s);
    }
  }
}

struct Honest {
  double error_deg = 0;  // mean of |joint - command|, the command within its limits
  int faults = 0;
  int impacts = 0;
  int pressed_ms = 0;
  double fastest_deg_s = 0;
};

Honest honest(int minutes, bool watched, double speed_share = 1, double friction_share = 1,
              bool together = false, double noise_deg = 0.15) {
  ElasticBench bench;
  bench.honest_noise_deg = noise_deg;
  bench.c = elastic_settings(watched);
  Commands one(11);
  Commands two(together ? 11 : 12);
  for (Motor& m : bench.motor) {
    m.full_speed_deg_s *= speed_share;
    m.friction *= friction_share;
  }
  Honest out;
  const int end_ms = minutes * 60000;
  for (int ms = 0; ms < end_ms; ++ms) {
    const double command = one.next();
    bench.tick({command, two.next()});
    out.error_deg += std::abs(bench.motor[0].angle_deg - std::clamp(command, 30.0, 111.0)) / end_ms;
  }
  for (const Motor& m : bench.motor) {
    out.impacts += m.impacts;
    out.pressed_ms += m.pressed_ms;
    out.fastest_deg_s = std::max(out.fastest_deg_s, m.fastest_deg_s);
  }
  out.faults = bench.faults;
  return out;
}

TEST(Protection, AnHonestHandOfHalfAnHourHasNoFaultAndTracksNoWorse) {
  const Honest guarded = honest(30, true);
  EXPECT_EQ(guarded.faults, 0);
  EXPECT_LE(guarded.impacts, 1) << "soft stops";
  EXPECT_EQ(guarded.pressed_ms, 0);
  EXPECT_LE(guarded.fastest_deg_s, kTop_deg_s);
  EXPECT_GT(guarded.fastest_deg_s, 300);
  const Honest bare = honest(30, false);
  EXPECT_LT(guarded.error_deg, 1.02 * bare.error_deg);
  EXPECT_GT(guarded.error_deg, 0.7 * bare.error_deg) << "too good";
  EXPECT_GT(bare.impacts, 20) << "the stops can be hit";
}

// Motors differ from their data sheets.
TEST(Protection, AMotorOfTheSameKindIsNoFault) {
  for (const double speed : {0.85, 1.0, 1.15}) {
    for (const double friction : {0.6, 1.4}) {
      const Honest one = honest(10, true, speed, friction);
      EXPECT_EQ(one.faults, 0) << speed << ' ' << friction;
      EXPECT_LE(one.fastest_deg_s, kTop_deg_s) << speed << ' ' << friction;
    }
  }
}

TEST(Protection, AHeldFingerGivesUpAndComesBackWhenTheCommandDoes) {
  ElasticBench bench;
  bench.motor[0].wall_deg = 80;
  for (int ms = 0; ms < 1500; ++ms) bench.tick({110, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::stalled);
  EXPECT_LE(bench.motor[0].pressed_ms, kLongest_ms);
  EXPECT_GT(bench.motor[0].pressed_ms, 10) << "a touch is no stall";
  for (int ms = 0; ms < 1000; ++ms) bench.tick({50, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::none);
  EXPECT_NEAR(bench.motor[0].angle_deg, 50, 1.5);
}

TEST(Protection, AFrozenReadingIsFrozenOnceBothWaysWereTriedAndEndsWithAMovement) {
  ElasticBench bench;
  for (int ms = 0; ms < 500; ++ms) bench.tick({70, 60});
  bench.begin(Lie::frozen);
  for (int ms = 0; ms < 500; ++ms) bench.tick({100, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::stalled);
  for (int ms = 0; ms < 1000; ++ms) bench.tick({40, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::frozen);
  for (int ms = 0; ms < 2000; ++ms) bench.tick({ms < 1000 ? 40.0 : 100.0, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::frozen);
  bench.motor[0].angle_deg = bench.lie_from_deg;
  bench.lie = Lie::none;
  for (int ms = 0; ms < 300; ++ms) {
    if (ms < 30) bench.motor[0].angle_deg += 0.1;  // somebody bends it: it lives
    bench.tick({70, 60});
  }
  for (int ms = 0; ms < 2000; ++ms) bench.tick({100, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::none);
  EXPECT_NEAR(bench.motor[0].angle_deg, 100, 1.5);
}

// A neighbour that moves alike for a window is no hand that bends it.
TEST(Protection, AReversedReadingStaysSoWhateverItsNeighbourReads) {
  ElasticBench bench;
  Finger& finger = bench.finger[1];
  const auto run = [&](int ms, Neighbour neighbour) {
    for (int k = 0; k < ms; ++k) {
      const double deg = 140 - bench.motor[1].angle_deg;
      bench.motor[1].step(finger.tick(bench.c, Link::following, 100 * 16, 30 * 16, ElasticBench::counts(deg),
                                      k % kTurn_ticks == 0, neighbour));
    }
  };
  run(300, {});
  ASSERT_EQ(finger.fault(), Fault::reversed);
  run(64, {0, true});
  run(2000, {});
  EXPECT_EQ(finger.fault(), Fault::reversed);
}

TEST(Protection, AShadowIsOverAFifthOfASecondAfterItsEndAndNoSooner) {
  for (const int shadowed_ms : {150, 175, 200, 225}) {
    ElasticBench bench;
    Finger& finger = bench.finger[1];
    int ended_ms = 0;
    for (int k = 0; k < 1000 + shadowed_ms && ended_ms == 0; ++k) {
      const bool shadowed = k >= 500 && k < 500 + shadowed_ms;
      (void)finger.tick(bench.c, Link::following, 70 * 16, 30 * 16, ElasticBench::counts(70),
                        k % kTurn_ticks == 0, {0, shadowed});
      if (k >= 500 + shadowed_ms && finger.fault() == Fault::none) ended_ms = k - 500 - shadowed_ms;
    }
    EXPECT_GE(ended_ms, 90) << shadowed_ms;
    EXPECT_LE(ended_ms, 210) << shadowed_ms;
  }
}

TEST(Protection, ASlipEndsWhereTheReadingIsBackAndNowhereElse) {
  ElasticBench bench;
  for (int ms = 0; ms < 1000; ++ms) bench.tick({60, 60});
  bench.begin(Lie::slipped);
  for (int ms = 0; ms < 3000; ++ms) bench.tick({90, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::slipped);
  EXPECT_NEAR(bench.motor[0].angle_deg, 60, 1);
  bench.lie = Lie::none;
  for (int ms = 0; ms < 2000; ++ms) bench.tick({90, 60});
  EXPECT_EQ(bench.finger[0].fault(), Fault::none);
  EXPECT_NEAR(bench.motor[0].angle_deg, 90, 1.5);
}

// Good potentiometers of two fingers with the same command may agree to a count for as long as they move.
TEST(Protection, FingersThatMoveAsOneAreNoFault) {
  for (const double noise_deg : {0., 0.03, 0.06, 0.1, 0.15})
    EXPECT_EQ(honest(10, true, 1, 1, true, noise_deg).faults, 0) << noise_deg;
}

struct Grip {
  int pressed_ms = 0;  // at worst
  int lies = 0;        // times that a thing was taken for a potentiometer that lies
  int runs = 0;
  int opened = 0;
  int closed = 0;  // once the thing is gone
};

// Ten seconds commanded to close on a thing at 80 degrees, two to open, twenty to close again without it.
void grip(double duty_per_deg, double friction, std::uint64_t seed, Grip& out) {
  ElasticBench bench;
  bench.random.seed(seed);
  Motor& m = bench.motor[0];
  m.friction *= friction;
  m.wall_deg = 80;
  m.wall_duty_per_deg = duty_per_deg;
  const double speeds[] = {20, 83, 300, 1e6};
  double at = m.angle_deg = bench.uniform(31, 78);
  for (int ms = 0; ms < 10000; ++ms) {
    at = std::min(110.0, at + speeds[seed % 4] / 1000);
    bench.tick({at, 60});
    out.lies += bench.finger[0].fault() > Fault::stalled;
  }
  out.pressed_ms = std::max(out.pressed_ms, m.pressed_ms);
  for (int ms = 0; ms < 2000; ++ms) bench.tick({40, 60});
  out.opened += std::abs(m.angle_deg - 40) < 2;
  m.wall_deg = 1e9;
  for (int ms = 0; ms < 20000; ++ms) bench.tick({105, 60});
  out.closed += std::abs(m.angle_deg - 105) < 3;
  ++out.runs;
}

TEST(Protection, AHeldThingIsGivenWayToWhateverItsStiffnessAndIsNoLie) {
  const struct {
    double duty_per_deg;
    int pressed_ms;
  } things[] = {{0.02, 180}, {0.05, 100},        {0.1, 85},          {0.2, 60},
                {0.3, 60},   {0.4, kLongest_ms}, {0.6, kLongest_ms}, {0.8, kLongest_ms}};
  for (const auto& thing : things) {
    for (const double friction : {0.6, 1.0, 1.4}) {
      Grip out;
      for (std::uint64_t seed = 1; seed <= 20; ++seed) grip(thing.duty_per_deg, friction, seed, out);
      EXPECT_LE(out.pressed_ms, thing.pressed_ms) << thing.duty_per_deg << ' ' << friction;
      EXPECT_GT(out.pressed_ms, 10) << "a touch is no stall";
      EXPECT_EQ(out.lies, 0) << thing.duty_per_deg << ' ' << friction;
      EXPECT_EQ(out.opened, out.runs) << thing.duty_per_deg << ' ' << friction;
      EXPECT_EQ(out.closed, out.runs) << thing.duty_per_deg << ' ' << friction;
    }
  }
}

// Windows of a pair that moves by 20 counts each: `follows` of what is commanded of the second besides, 4 counts a degree.
int windows_until_shadowed(double follows, int moved = 20) {
  NeighbourWatch pair;
  double a = 300;
  double b = 300;
  int probe = 0;
  for (int k = 0; k < 100; ++k) {
    pair.look(static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), static_cast<std::int16_t>(probe),
              k % 2 == 0);
    if (pair.shadowed()) return k;
    const int next = pair.of_second().probe;
    a += k % 40 < 20 ? moved : -moved;
    b += (k % 40 < 20 ? moved : -moved) + follows * (next - probe) / 16 * 4;
    probe = next;
  }
  return -1;
}

TEST(NeighbourWatch, AShadowIsOneThatMovesAgainstItsCommand) {
  EXPECT_GE(windows_until_shadowed(0), 4);
  EXPECT_LE(windows_until_shadowed(0), 10);
  EXPECT_EQ(windows_until_shadowed(1), -1);
  EXPECT_EQ(windows_until_shadowed(0.6), -1);
  EXPECT_EQ(windows_until_shadowed(0, 1), -1) << "both stand";
}

TEST(NeighbourWatch, AShadowEndsWhereOneMovesWithoutTheOther) {
  NeighbourWatch pair;
  std::uint16_t at = 300;
  for (int k = 0; k < 20; ++k) {
    pair.look(at, at, static_cast<std::int16_t>(k % 2 == 0 ? 24 : -24), k % 2 == 0);
    at = static_cast<std::uint16_t>(at + 15);
  }
  EXPECT_TRUE(pair.shadowed());
  EXPECT_EQ(pair.of_second().probe, 0);
  pair.look(at, static_cast<std::uint16_t>(at - 15), 0, true);
  EXPECT_FALSE(pair.shadowed());
}

}  // namespace
}  // namespace flexor::hand
