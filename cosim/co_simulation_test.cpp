// Both boards in the twin's world: it agrees with the twin, and survives what radios, sensors, supplies and
// attackers do.
#include "cosim/co_simulation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "cosim/built_images_test.hpp"
#include "cosim/radio_ear.hpp"
#include "host/deploy/images.hpp"
#include "host/io/io.hpp"
#include "host/study/boards.hpp"
#include "runtime/link/hand_end.hpp"

namespace flexor::cosim {
namespace {

constexpr double kBound_deg_s = 400;  // of the set-point, in the safe hand

const twin::Parameters kParameters;

// The images that a user would flash.
const Images& images() {
  static const Images built = built_images(published_input());
  return built;
}

using Path = std::vector<std::array<double, 5>>;  // joints, each millisecond

// One gesture, watched: limits and speeds in every millisecond, and how the end stops were treated.
class Watched {
 public:
  explicit Watched(ByteFaults faults = {}) : input_(steady()), simulation(images(), input_, 0, faults) {}

  std::function<void(std::int64_t)> disturb;

  Path run() {
    Path path;
    constexpr std::size_t kWindow_ms = 10;
    std::array<std::deque<int>, 5> before;  // set-points, 0 while the hand is off
    simulation.on_ms = [&](std::int64_t now) {
      if (disturb) disturb(now);
      const HandStatus status = simulation.hand_status();
      const bool on =
          status.finger_bytes != 0 && status.finger_bytes != 0xa5;  // RAM is set up, not painted or cleared
      std::array<double, 5> joints{};
      for (int i = 0; i < 5; ++i) {
        const auto f = static_cast<std::size_t>(i);
        joints[f] = simulation.world().joint_deg(i);
        fastest_deg_s = std::max(fastest_deg_s, std::abs(simulation.world().speed_deg_s(i)));
        const int setpoint = status.setpoint[i];
        if (on && setpoint != 0) {
          EXPECT_GE(setpoint, std::lround(16 * kParameters.hand_lower_deg[f])) << now;
          EXPECT_LE(setpoint, std::lround(16 * kParameters.hand_upper_deg[f])) << now;
          // A tick that waits for a tag may fall into the next millisecond: one more of them in ten.
          const int way = before[f].size() == kWindow_ms && before[f].front() != 0
                              ? std::abs(setpoint - before[f].front())
                              : 0;
          EXPECT_LE(way, 16 * kBound_deg_s / 1000 * (kWindow_ms + 1) + 1) << now;
        }
        before[f].push_back(on ? setpoint : 0);
        if (before[f].size() > kWindow_ms) before[f].pop_front();
      }
      if (now >= 0) path.push_back(joints);
    };
    const twin::Trial trial = simulation.run();
    // The motor overshoots its set-point's speed a little.
    EXPECT_LT(fastest_deg_s, 1.5 * kBound_deg_s);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(trial.pressed_s[i], 0) << i;
    return path;
  }

  double fastest_deg_s = 0;

 private:
  // Without bursts of contact noise, which would come at other instants after a restart of the glove.
  static twin::TrialInput steady() {
    twin::TrialInput input = published_input();
    input.parameters.burst_rate_per_s = 0;
    return input;
  }
  twin::TrialInput input_;

 public:
  CoSimulation simulation;
};

const Path& undisturbed() {
  static const Path path = Watched().run();
  return path;
}

// Largest distance from the undisturbed run between two times.
double apart_deg(const Path& path, double from_s, double to_s) {
  double out = 0;
  const Path& other = undisturbed();
  for (auto k = static_cast<std::size_t>(1000 * from_s);
       k < std::min<std::size_t>({path.size(), other.size(), static_cast<std::size_t>(1000 * to_s)}); ++k) {
    for (std::size_t i = 0; i < 5; ++i) out = std::max(out, std::abs(path[k][i] - other[k][i]));
  }
  return out;
}

constexpr double kSame_deg = 6;  // noise of the sensors, and samples at other instants of a movement

// A glove that started again samples at other instants: up to a period at the gesture's speed on top.
constexpr double kOtherPhase_deg = kSame_deg + 83 * 0.05;

// A hand that started again, or received other frames, probes fingers that move alike at other instants: 1.5 degrees to either side.
constexpr double kProbes_deg = 3;
constexpr double kOtherProbe_deg = kOtherPhase_deg + kProbes_deg;

// And leaves out other frames for the hand: a period more. Of the 50 ms a frame takes 24 bytes x 10 / 9600 baud = 25, and
// the modules 2 to 3; what the hand sends takes 25 bytes, 26 ms, 2 to 3 in the modules and 1 or 2 until its tick: 56 to 59.
constexpr double kLeftOut_deg = 83 * 0.05;

// Good again at good_s: within a second the hand is where it would be anyway.
void expect_recovery(const Path& path, double good_s, double same_deg = kSame_deg) {
  EXPECT_LT(apart_deg(path, good_s + 1, 10), same_deg);
}

TEST(Fault, NoneFollowsTheFinger) {
  Watched w;
  const Path path = w.run();
  EXPECT_LT(apart_deg(path, 0, 10), 1e-9) << "the same trial twice";
  EXPECT_EQ(w.simulation.link_statistics().corrupt + w.simulation.link_statistics().malformed, 0U);
  EXPECT_GT(w.simulation.link_statistics().received, 200U);
  EXPECT_EQ(w.simulation.hand_status().overruns, 0);
}

// Shares of bytes that are lost, and of bits that flip.
class WrongBytes : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(WrongBytes, TheHandStaysSafeAndComesBack) {
  Watched w({GetParam().first, GetParam().second, 2, 6.5});
  expect_recovery(w.run(), 6.5);
  const auto s = w.simulation.link_statistics();
  EXPECT_GT((GetParam().first > 0 ? s.lost : 0) + s.corrupt + s.malformed, 0U);
}
INSTANTIATE_TEST_SUITE_P(Fault, WrongBytes,
                         testing::Values(std::pair(0.01, 0.), std::pair(0.05, 0.), std::pair(0.1, 0.),
                                         std::pair(0.2, 0.), std::pair(0.3, 0.), std::pair(0., 0.001),
                                         std::pair(0., 0.01), std::pair(0., 0.1)));

TEST(Fault, AnOutageOfTwoSecondsEndsAtRestAndWithoutAJump) {
  Watched w;
  bool rested = false;
  w.disturb = [&](std::int64_t now) {
    w.simulation.radio_on = now < 1000 || now >= 3000;
    if (now == 2900) rested = w.simulation.hand_status().link == 2;
  };
  const Path path = w.run();
  EXPECT_TRUE(rested) << "a lost link is a state of its own, not a fault";
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(path[2900][i], i == 0 ? 90 : 29, 3) << i;
  EXPECT_LT(apart_deg(path, 0, 1.2), kSame_deg + kProbes_deg) << "it holds for a quarter of a second";
  expect_recovery(path, 3, kOtherPhase_deg);
}

TEST(Fault, ASensorIsReportedThatIsUnpluggedOrShortedWhoseFingerRestsOrStuckWhoseFingerStays) {
  for (const auto& [counts, expected, after_ms] : {std::tuple{1023, 1, 100}, {0, 2, 100}, {700, 3, 2000}}) {
    const int ends_ms = 500 + after_ms + 2000;
    Watched w;
    w.simulation.on_reading = [&, value = counts](std::int64_t now, int finger, int reading) {
      return finger == 1 && now >= 500 && now < ends_ms ? value : reading;
    };
    // What the glove reports of its sensors.
    const deploy::Key key = study::bench_key();
    RadioEar ear(key);
    int received_ms = -1;
    w.simulation.on_answer = [&](Cycles, std::uint8_t byte) { ear.hand_sent(byte); };
    w.simulation.on_air = [&, status = expected](Cycles cycle, std::uint8_t byte) {
      if (ear.glove_sent(byte) != link::Received::frame) return;
      const auto now = static_cast<int>(CoSimulation::time_ms(cycle));
      if (received_ms < 0 && now > 500 && static_cast<int>(ear.receiver().frame().status[1]) == status)
        received_ms = now;
    };
    const Path path = w.run();
    EXPECT_GE(received_ms, 500 + after_ms - 100) << "a sample period, and one that began before";
    EXPECT_LE(received_ms, 500 + after_ms + 75) << "a sample period and the frame's way";
    const auto at = static_cast<std::size_t>(ends_ms - 100);
    EXPECT_NEAR(path[at][1], expected == 3 ? path[at - 1900][1] : 29, 3);
    EXPECT_LT(std::abs(path[at][2] - undisturbed()[at][2]), kSame_deg) << "the other fingers go on";
    expect_recovery(path, ends_ms / 1000.0);
  }
}

class BrownOut : public testing::TestWithParam<double> {};

TEST_P(BrownOut, OfEitherBoardInTheMiddleOfAGesture) {
  for (const bool glove : {true, false}) {
    Watched w;
    w.disturb = [&](std::int64_t now) {
      Board& board = glove ? w.simulation.glove() : w.simulation.hand();
      if (now == std::llround(1000 * GetParam())) board.power_off(board.now() + 50 * kCyclesPerMs);
    };
    expect_recovery(w.run(), GetParam() + 0.05, glove ? kOtherPhase_deg + kLeftOut_deg : kOtherProbe_deg);
  }
}
INSTANTIATE_TEST_SUITE_P(Fault, BrownOut, testing::Values(1.0, 3.9, 4.2, 5.9));

twin::Motion still(double length_s) {
  std::array<std::vector<double>, 5> angle;
  for (auto& finger : angle) finger.assign(2, 100);
  return twin::Motion::from_samples("still", {0, length_s}, angle);
}

// Of either board or both, after a time without supply; `forget`: what they keep without it is erased.
struct Start {
  bool glove, hand;
  int off_ms;
  bool forget = false;
};

// Seconds from a start until a frame is believed: the longest of them all. `next` gives a start at this instant, if there is one; it is
// asked while the boards are in touch.
double slowest_start_s(const twin::TrialInput& input,
                       const std::function<std::optional<Start>(std::int64_t now)>& next) {
  const Images own = built_images(input);
  CoSimulation simulation(own, input, 0);
  std::int64_t on_ms = 0;
  std::int64_t worst_ms = 0;
  std::uint32_t before = 0;
  bool waits = false;
  simulation.on_ms = [&](std::int64_t now) {
    const std::uint32_t received = simulation.link_statistics().received;
    if (waits && now == on_ms + 5) before = received;  // RAM is clear by then
    if (waits && now > on_ms + 5) {
      worst_ms = std::max(worst_ms, now - on_ms);
      waits = received == before;
    }
    const std::optional<Start> start = waits ? std::nullopt : next(now);
    if (!start) return;
    for (const auto& [board, starts] :
         {std::pair(&simulation.glove(), start->glove), {&simulation.hand(), start->hand}}) {
      if (starts) board->power_off(board->now() + static_cast<Cycles>(start->off_ms) * kCyclesPerMs);
      if (start->forget) std::fill_n(board->eeprom().bytes, Board::kEepromBytes, std::uint8_t{0xff});
    }
    on_ms = now + start->off_ms;
    waits = true;
  };
  (void)simulation.run();
  std::printf("%g Hz, %g baud: worst %lld ms\n", 1 / input.compensator.sample_period_s, input.parameters.baud,
              static_cast<long long>(worst_ms));
  return static_cast<double>(worst_ms) / 1000;
}

// Of one board, each start after a longer time without supply.
double slowest_of_ordered_starts_s(double rate_hz, bool glove, int from_ms, int to_ms, int step_ms) {
  constexpr int kTogether_ms = 1900;  // longer than any takes
  const int apart_ms = to_ms + kTogether_ms;
  const int count = (to_ms - from_ms) / step_ms + 1;
  twin::TrialInput input = published_input(rate_hz);
  input.motion = still(count * apart_ms / 1000.);
  return slowest_start_s(input, [&](std::int64_t now) -> std::optional<Start> {
    if (now <= 0 || now % apart_ms != 0 || now / apart_ms > count) return {};
    return Start{glove, !glove, from_ms + (static_cast<int>(now / apart_ms) - 1) * step_ms};
  });
}

// Two clocks that run alike must not begin together again and again: a hand that challenged every 200 ms received nothing of a
// glove that reported every 200 ms, if it had begun in the same moment.
TEST(Freshness, NoInstantOfAStartKeepsTheBoardsApart) {
  for (const double rate_hz : {20., 100.}) {
    // Its hand holds the session that the glove has forgotten for an outage, and such a glove gives a turn every 0.2 s.
    EXPECT_LT(slowest_of_ordered_starts_s(rate_hz, true, 20, 110, 6), link::kOutage_ms / 1000. + 0.2)
        << rate_hz;
    EXPECT_LT(slowest_of_ordered_starts_s(rate_hz, true, 550, 760, 3), 0.45) << rate_hz;
    EXPECT_LT(slowest_of_ordered_starts_s(rate_hz, false, 20, 110, 3), 0.85) << rate_hz;  // asked: 2
  }
}

twin::TrialInput still_input(double rate_hz, double baud, double length_s) {
  twin::TrialInput input = published_input(rate_hz);
  input.parameters.baud = baud;
  input.parameters.frame_rate_hz = 0;
  input.motion = still(length_s);
  return input;
}

// Of either board or both, off for any time up to 0.2 s, again as soon as they are in touch.
double slowest_of_random_starts_s(double rate_hz, double baud, double length_s, bool forget = false) {
  std::mt19937 random(1);
  std::int64_t next_ms = 200;
  bool is_drawn = true;
  int starts = 0;
  const auto next = [&](std::int64_t now) -> std::optional<Start> {
    if (!std::exchange(is_drawn, true)) next_ms = now + static_cast<std::int64_t>(random() % 300);
    if (now < next_ms) return {};
    is_drawn = false;
    ++starts;
    const auto who = static_cast<unsigned>(1 + random() % 3);
    return Start{(who & 1U) != 0, (who & 2U) != 0, static_cast<int>(1 + random() % 200), forget && who == 3};
  };
  const double worst_s = slowest_start_s(still_input(rate_hz, baud, length_s), next);
  EXPECT_GT(starts, length_s);
  return worst_s;
}

// At these rates a glove that waits is silent for as long as its hand waited between two challenges.
TEST(Freshness, NoRateKeepsTheBoardsApart) {
  EXPECT_LT(slowest_of_random_starts_s(50, 19200, 120), 1);
  EXPECT_LT(slowest_of_random_starts_s(100, 57600, 60), 1);
  EXPECT_LT(slowest_of_random_starts_s(20, 9600, 60, true), 2);
}

// Share of 12 seconds in which the hand follows, while somebody without the key sends this to both boards every 60 ms: of several
// senders, as a single one is worth a tenth more or less with each millisecond that a board takes longer.
double followed(const Images& own, const twin::TrialInput& input, const std::vector<std::uint8_t>& sent) {
  int followed_ms = 0;
  int all_ms = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    CoSimulation simulation(own, input, 0);
    std::mt19937 random(seed);
    std::int64_t next_ms = 500;
    simulation.on_ms = [&](std::int64_t now) {
      if (now < 0) return;
      ++all_ms;
      followed_ms += simulation.hand_status().link == 1;
      if (now < next_ms) return;
      simulation.inject(sent);
      simulation.inject_to_glove(sent);
      next_ms = now + 45 + static_cast<std::int64_t>(random() % 30);
    };
    (void)simulation.run();
  }
  return static_cast<double>(followed_ms) / all_ms;
}

std::vector<std::uint8_t> unguarded(link::Type type, const std::vector<std::uint8_t>& body,
                                    bool listens = false) {
  link::Packet packet;
  std::copy(body.begin(), body.end(), packet.body());
  std::vector<std::uint8_t> wire(link::kMaxWire + 1, link::kDelimiter);
  wire.resize(1U + packet.seal({type, false, listens, 0}, static_cast<std::uint8_t>(body.size()), nullptr,
                               wire.data() + 1));
  return wire;
}

std::vector<std::uint8_t> rubbish_like(std::vector<std::uint8_t> wire) {
  std::fill(wire.begin() + 1, wire.end() - 1, 0x55);
  return wire;
}

// What nobody guards costs the time on the air that it takes, and little more.
TEST(Link, WhoHasNoKeyIsWorthLittleMoreThanRubbish) {
  const twin::TrialInput input = still_input(20, 9600, 12);
  const Images own = built_images(input);
  link::State lost{};
  lost.has_key = true;
  std::vector<std::uint8_t> state(link::State::kBytes);
  link::put_state(lost, state.data());
  const auto follows = [&](const char* what, const std::vector<std::uint8_t>& sent) {
    const double out = followed(own, input, sent);
    std::printf("the hand follows for %.3f with %s\n", out, what);
    return out;
  };
  const auto request = unguarded(link::Type::request, {3});
  const double rubbish = follows("rubbish", rubbish_like(request));
  const double long_rubbish = follows("long rubbish", rubbish_like(unguarded(link::Type::state, state)));
  EXPECT_GT(rubbish, 0.9);
  EXPECT_GE(follows("requests", request), 0.9 * rubbish);
  EXPECT_GE(follows("pieces", unguarded(link::Type::coefficients, {9})), 0.95 * rubbish);
  EXPECT_GE(follows("lost touch", unguarded(link::Type::state, state)), 0.97 * long_rubbish);
  EXPECT_GE(follows("turns", unguarded(link::Type::state, state, true)), 0.97 * long_rubbish);
}

// Once a second a byte that announces a model: no frame is left out for it.
TEST(Link, APieceThatIsNotBelievedGetsNoTurn) {
  const twin::TrialInput input = still_input(20, 9600, 6);
  const Images own = built_images(input);
  CoSimulation simulation(own, input, 0);
  std::uint32_t first = 0;
  simulation.on_ms = [&](std::int64_t now) {
    if (now == 0) first = simulation.link_statistics().received;
    if (now % 1000 == 500) simulation.inject_to_glove(unguarded(link::Type::coefficients, {9}));
  };
  (void)simulation.run();
  const double frames_hz = (simulation.link_statistics().received - first) / 6.;
  EXPECT_GT(frames_hz, 16);
  EXPECT_LT(frames_hz, 20);
}

// Both directions in one air: what the hand sends while the glove sends is lost, and the glove's too.
TEST(Link, TheHandSendsOnlyWhileTheGloveListens) {
  for (const double rate_hz : {10., 20., 50., 100.}) {
    const twin::TrialInput input = published_input(rate_hz);
    const Images own = built_images(input);
    CoSimulation simulation(own, input, 0);
    link::PacketReader reader;
    int telemetry = 0;
    int states = 0;
    simulation.on_answer = [&](Cycles, std::uint8_t byte) {
      if (reader.push(byte) != link::Received::pending) return;
      telemetry += reader.type() == link::Type::telemetry;
      states += reader.type() == link::Type::state;
    };
    const twin::Trial trial = simulation.run();
    const double seconds = static_cast<double>(simulation.world().end_ms()) / 1000;
    EXPECT_GT(telemetry, 0.6 * seconds) << rate_hz;
    EXPECT_LT(telemetry, 3 * seconds) << rate_hz;
    EXPECT_GE(states, 1) << rate_hz;
    EXPECT_LE(trial.frames_lost, 1) << rate_hz << ": one may meet the first challenge";
  }
}

struct OverSlowRadio {
  double follows;  // share of a minute
  double lost;     // share of the frames
};
OverSlowRadio over_slow_radio(double rate_hz, double one_way_s, double jitter_s, double loss) {
  twin::TrialInput input = still_input(rate_hz, 9600, 60);
  const Images own = built_images(input);
  input.parameters.module_latency_s = one_way_s;
  input.parameters.jitter_s = jitter_s;
  input.parameters.loss = loss;
  CoSimulation simulation(own, input, 0);
  int following = 0;
  simulation.on_ms = [&](std::int64_t now) {
    following += now > 0 && simulation.hand_status().link == static_cast<std::uint8_t>(hand::Link::following);
  };
  const twin::Trial trial = simulation.run();
  return {static_cast<double>(following) / static_cast<double>(simulation.world().end_ms()),
          static_cast<double>(trial.frames_lost) / trial.frames_sent};
}

TEST(Link, ASlowRadioIsNoOutage) {
  EXPECT_GE(over_slow_radio(20, 0.5, 0.25, 0.1).follows, 0.95);
  for (const double one_way_s : {0.05, 0.08, 0.17, 0.38}) {
    const OverSlowRadio radio = over_slow_radio(10, one_way_s, 0, 0);
    EXPECT_GE(radio.follows, 0.95) << one_way_s;
    EXPECT_LE(radio.lost, 0.05) << one_way_s << ": each turn comes when the next frame does";
  }
}

// The total error of six gestures, each compensator, within 5 % of the twin's, same trials.
TEST(Twin, AgreesWithTheCoSimulation) {
  study::Boards boards(FLEXOR_COSIM);
  study::Plan plan;
  plan.parameters = kParameters;
  plan.parameters.frame_bytes = link::frame_bytes(true);
  plan.motions = study::motions("1-6");
  for (const char* name : {"raw", "published-w", "published-hw"})
    plan.compensators.push_back(study::compensator(name, 10));
  plan.trials = 6;  // Raw winds up: two trials of it differ by more than what is asked here
  plan.seed = 5;
  plan.threads = 2;
  const study::Result twin = study::run(plan, {});
  plan.engine = &boards;
  const study::Result on_boards = study::run(plan, {});
  for (std::size_t c = 0; c < plan.compensators.size(); ++c) {
    double of_twin = 0;
    double of_boards = 0;
    for (std::size_t m = 0; m < plan.motions.size(); ++m) {
      of_twin += twin.cell(m, c).total_deg_s.mean();
      of_boards += on_boards.cell(m, c).total_deg_s.mean();
    }
    EXPECT_NEAR(of_boards / of_twin, 1, 0.05) << plan.compensators[c].name;
    EXPECT_NE(of_boards, of_twin) << "has the engine run at all?";
  }
}

TEST(CoSimulation, IsTheSameOnOneThreadAndOnTwo) {
  study::Boards boards(FLEXOR_COSIM);
  study::Plan plan;
  plan.parameters = kParameters;
  plan.motions = study::motions("4");
  plan.compensators = {study::compensator("published-hw", 10)};
  plan.trials = 18;  // two batches
  plan.engine = &boards;
  plan.threads = 1;
  const auto one = study::run(plan, {});
  plan.threads = 2;
  const auto two = study::run(plan, {});
  EXPECT_EQ(one.cell(0, 0).total_deg_s.mean(), two.cell(0, 0).total_deg_s.mean());
  EXPECT_EQ(one.cell(0, 0).total_deg_s.ci95(), two.cell(0, 0).total_deg_s.ci95());
}

TEST(Latency, EveryStageIsWhatTheClocksGive) {
  study::Boards boards(FLEXOR_COSIM);
  const auto mean = [](const std::vector<study::Latency>& edges, std::size_t stage) {
    double sum = 0;
    for (const auto& edge : edges) sum += edge[stage] / static_cast<double>(edges.size());
    return sum;
  };
  const auto slow = boards.latency(kParameters, study::compensator("published-hw", 10).model, 40, 1);
  ASSERT_EQ(slow.size(), 40U);
  EXPECT_NEAR(mean(slow, 0), 50, 15);  // half a period
  // Conversions from the edge's finger on, readings, model.
  EXPECT_NEAR(mean(slow, 1), 0.45 + 0.24 + 0.18, 0.1);
  EXPECT_LT(mean(slow, 2), 1);  // each sample makes a frame
  EXPECT_NEAR(mean(slow, 3), 26 + 2 + 1,
              1);  // 25 bytes at 9600 baud, two milliseconds in the modules, one of jitter
  EXPECT_NEAR(mean(slow, 4), 0.85, 0.4);  // one tag
  EXPECT_LT(mean(slow, 5), 1.2);
  twin::Parameters p = kParameters;
  p.frame_rate_hz = 20;
  const auto quick = boards.latency(p, study::compensator("published-hw", 100).model, 40, 1);
  ASSERT_EQ(quick.size(), 40U);
  EXPECT_NEAR(mean(quick, 0), 5, 1.5);
  EXPECT_NEAR(mean(quick, 2), 20, 6);  // 0 to 40 ms until the next of every fifth sample
}

// Ten frames a second of which every tenth is lost: an edge whose frame is lost is counted as such, and no
// other edge is taken for late.
TEST(Latency, LostFramesAreLostAndNotLate) {
  study::Boards boards(FLEXOR_COSIM);
  twin::Parameters p = kParameters;
  p.loss = 0.1;
  constexpr int kEdges = 80;
  const auto edges = boards.latency(p, study::compensator("published-hw", 10).model, kEdges, 1);
  for (const auto& edge : edges) {
    const double total_ms = std::accumulate(edge.begin(), edge.end(), 0.0);
    EXPECT_GT(total_ms, 25);
    EXPECT_LT(total_ms, 150) << "a period, the UART and the rest";
    EXPECT_LT(edge[3], 35) << "25 bytes at 9600 baud and the modules";
  }
  EXPECT_LE(edges.size(), kEdges - 2U);
  EXPECT_GE(edges.size(), kEdges - 20U);
}

}  // namespace
}  // namespace flexor::cosim
