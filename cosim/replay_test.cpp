// What the glove's image sends equals the host's runtime on the same counts, to the bit, and what it costs.
#include "cosim/replay.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>

#include "host/deploy/images.hpp"
#include "host/deploy/model_block.hpp"
#include "host/deploy/wiring.hpp"
#include "host/identify/identify.hpp"
#include "host/io/io.hpp"
#include "host/model/random_glove.hpp"
#include "host/model/wiring.hpp"
#include "host/recording/csv.hpp"
#include "host/study/glove_fit.hpp"
#include "runtime/core/flash_map.hpp"
#include "runtime/link/opengloves.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;
using deploy::GloveFigures;

class Replay : public testing::Test {
 protected:
  deploy::Glove glove_of(const model::Model& model) const {
    return deploy::glove_for({}, model, study::bench_key());
  }
  void expect_exact(const model::Model& model, const Counts& counts) {
    const deploy::Glove glove = glove_of(model);
    const GloveFigures f = replay(glove, counts);
    // No hand is received: frames are left out for it.
    const link::Turns turns = deploy::turns_of(glove);
    const auto slots = counts.size() / static_cast<std::size_t>(deploy::samples_per_frame(glove));
    const std::size_t frames = slots * turns.seek_every / (turns.seek_every + turns.slots);
    EXPECT_GE(f.frames + 5, frames) << model.name;
    EXPECT_LE(f.frames, frames + 5) << model.name;
    EXPECT_EQ(f.mismatches, 0U) << model.name;
  }
  static model::Model named(const char* name, double rate_hz = 10) {
    return study::compensator(name, rate_hz).model;
  }

  twin::Parameters parameters_;
  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

// Curves, plays, motion and a lead for each of five fingers, identified on the twin's glove.
model::Model identified(double rate_hz) {
  study::GloveRequest recorded;
  recorded.rate_hz = rate_hz;
  identify::Request request;
  request.rate_hz = rate_hz;
  request.lead_s = 0.1;
  request.structure = "curve(8) + play(0.08) > curve(8) + motion(0.15)";
  for (const std::string& finger : model::finger_names())
    request.map.push_back({finger, {finger + "_alpha_deg"}, finger + "_deg"});
  return identify::fit_takes(study::hand_recordings(study::record_glove(recorded)), request);
}

TEST_F(Replay, AGloveThatTracksItsSensorsIsTheHostToTheBit) {
  for (const double rate_hz : {10.0, 50.0}) {
    deploy::Glove glove = glove_of(named("published-hw", rate_hz));
    for (model::Input& input : glove.model.inputs) input.poses = model::Poses{40, 110};
    glove.model.inputs[1].poses.reset();
    glove.track = true;
    // Whole bends of a sensor that has moved, each finger by another way.
    Counts counts(static_cast<std::size_t>(60 * rate_hz));
    for (std::size_t k = 0; k < counts.size(); ++k) {
      const double t = std::fmod(static_cast<double>(k) / rate_hz, 6.0);
      const double closed = t < 1 ? t : t < 3 ? 1 : t < 4 ? 4 - t : 0;
      for (std::size_t i = 0; i < counts[k].size(); ++i)
        counts[k][i] =
            static_cast<int>(595 + 120 * closed) + static_cast<int>(6 * i) + static_cast<int>(k % 3);
    }
    const GloveFigures f = replay(glove, counts);
    EXPECT_GT(f.frames, 100U);
    EXPECT_EQ(f.mismatches, 0U) << rate_hz;
    model::HostChain tracked(deploy::chain_parts(glove));
    glove.track = false;
    model::HostChain plain(deploy::chain_parts(glove));
    int differ = 0;
    for (const auto& sample : counts) differ += tracked.step(sample).angle[2] != plain.step(sample).angle[2];
    EXPECT_GT(differ, 100) << "the sensors show the tracker nothing";
  }
}

TEST_F(Replay, GesturesAndReadingsAllOverTheRangeAreSentToTheBit) {
  for (const char* name : {"raw", "published-w", "published-hw"}) {
    const model::Model model = named(name);
    expect_exact(model, study::gesture_counts(parameters_, model));
    expect_exact(model, exercise(3000, 1));
  }
  model::Model pairs = named("published-hw");
  for (model::Block& block : pairs.blocks)
    if (std::holds_alternative<model::Lti>(block.kind)) block.kind = model::PolePair{18, 0.9, {-5, 8}};
  expect_exact(pairs, exercise(600, 1));
}

TEST_F(Replay, EveryRateIsSentToTheBit) {
  for (const double rate_hz : {20.0, 50.0, 100.0}) {
    expect_exact(named("published-hw", rate_hz), exercise(2000, 3));
    expect_exact(named("published-w", rate_hz), exercise(2000, 4));
  }
}

TEST_F(Replay, AnIdentifiedModelWithCurvesMotionAndLeadIsSentToTheBit) {
  for (const double rate_hz : {10.0, 50.0}) {
    const model::Model model = identified(rate_hz);
    const auto has = [&](const char* type) {
      return std::ranges::any_of(model.blocks, [&](const auto& b) { return model::type_of(b.kind) == type; });
    };
    ASSERT_TRUE(has("curve") && has("lag") && has("sum"));
    expect_exact(model, study::gesture_counts(parameters_, model));
    expect_exact(model, exercise(1500, 5));
  }
}

// A section of the program that adds up what others made, and reads no sensor itself; sensors that name no finger are on
// the sensors that are free.
TEST_F(Replay, SensorsThatSeveralJointsShareAreSentToTheBit) {
  model::Model model = named("published-hw");
  model.inputs.resize(2);
  for (std::size_t i = 0; i < 2; ++i) model.inputs[i].name = model.inputs[i].strip = "";
  model.inputs[0].name = "a";
  model.inputs[1].name = "b";
  const model::Curve curve{{40, 80, 160}, {20, 40, 70}};
  model.blocks = {{{"a"}, "index angle", curve},
                  {{"a"}, "from a", curve},
                  {{"b"}, "from b", curve},
                  {{"from a", "from b"}, "both", model::Sum{{0.5, 0.5}, 0}},
                  {{"index angle"}, "index", model::Saturation{25, 65}},
                  {{"both"}, "thumb", model::Saturation{25, 65}}};
  model.joints = {{"index", "index", 30, {}}, {"thumb", "thumb", 30, {}}, {"index_dip", "index", 30, {}}};
  EXPECT_EQ(model::left_out(model), std::vector<std::string>{"index_dip"});
  expect_exact(model, exercise(400, 8));
}

// Any graph of blocks that a glove could have.
class NewModels : public Replay, public testing::WithParamInterface<unsigned> {};

TEST_P(NewModels, AreSentToTheBit) {
  int sent = 0;
  for (unsigned seed = 1000 * GetParam(); sent < 5; ++seed) {
    model::Model model = model::RandomGlove(seed).make();
    const std::array rates_hz = {10.0, 20.0, 50.0, 100.0};
    model.sample_period_s = 1 / rates_hz.at(seed % 4);
    for (std::size_t j = 0; j < model.joints.size(); ++j) model.joints[j].name = model::finger_names()[j];
    try {
      (void)deploy::flash_block(glove_of(model));
    } catch (const io::InputError&) {
      continue;  // fixed point or the board do not hold it
    }
    ++sent;
    model.name = fmt::format("seed {}", seed);
    expect_exact(model, exercise(400, seed));
  }
}
INSTANTIATE_TEST_SUITE_P(Forty, NewModels, testing::Range(0U, 8U));

class RealReplay : public Replay {
 protected:
  void SetUp() override {
    if (!fs::exists(data()))
      GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
  }
  static fs::path data() { return fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove"; }

  // A raw log's readings as they came, row by row, on every sensor.
  static Counts counts_of(const fs::path& log, const std::string& column) {
    const recording::Recording r = recording::read_csv(log, {column});
    Counts out;
    for (const double value : r.column(column).value) {
      std::array<int, study::kFingers> sample{};
      sample.fill(static_cast<int>(std::lround(std::clamp(value, 0.0, 1023.0))));
      out.push_back(sample);
    }
    return out;
  }
};

TEST_F(RealReplay, RealRecordingsAreSentToTheBit) {
  for (const auto& [folder, column, reference] : {std::tuple{"index_ind2", "SensorA1", "∠ABC_smooth"},
                                                  std::tuple{"middle_mid1", "SensorA2", "∠BCD_smooth"}}) {
    const fs::path log = data() / folder / "sensor_log.csv";
    const Counts counts = counts_of(log, column);
    ASSERT_GT(counts.size(), 1000U);
    for (const char* name : {"published-w", "published-hw"}) expect_exact(named(name), counts);
    // And the compensator that these very recordings give: curve, poles and hysteresis in ADC counts.
    identify::Request request;
    request.pairs = {{log, data() / folder / "camera_angles.csv"}};
    request.map = {{"index", {column}, reference}};
    request.input_unit = "count";
    request.structure = "hysteresis(1) > curve(10) > lti(2) > saturation";
    const model::Model model = identify::identify_files(request, {}).model;
    expect_exact(model, counts);
  }
}

// The targets of the design, on the simulated ATmega328P: exact and repeatable.
TEST_F(Replay, CyclesAndSizesAreWithinTheirTargets) {
  // Readings that every channel takes, so that none is quick because it refuses.
  Counts counts = exercise(1500, 7);
  for (auto& sample : counts)
    for (int& n : sample) n = 440 + n % 400;
  const deploy::Image& glove = deploy::glove_image();
  const model::Model five = identified(10);
  for (const auto& [model, mean] :
       {std::pair{named("published-hw"), 3000}, {named("published-w"), 4000}, {five, 8000}}) {
    const GloveFigures f = replay(glove_of(model), counts);
    EXPECT_LE(f.step.mean(), mean) << model.name;
    EXPECT_GT(f.step.mean(), 1000) << "an interpreter is no quicker than what it interprets";
    EXPECT_LE(glove.ram_bytes() + f.stack_bytes, deploy::kAtmega328p.ram_bytes - 64) << model.name;
    EXPECT_LT(f.awake_share, 0.05) << "the glove should sleep";
    RecordProperty(model.name,
                   fmt::format("step {:.0f} / {}, stack {}", f.step.mean(), f.step.worst, f.stack_bytes));
  }
  EXPECT_LE(glove.flash_bytes(), core::kKeyBegin);
  const deploy::HandFigures hand = measure_hand(deploy::safe_hand({}, five, study::bench_key()), 2);
  EXPECT_LE(deploy::hand_image().flash_bytes(), 20 * 1024);
  EXPECT_LE(deploy::hand_image().ram_bytes() + hand.stack_bytes, deploy::kAtmega328p.ram_bytes - 400);
  EXPECT_LT(hand.tick.worst, 9700U) << "of 16000";
  EXPECT_GT(hand.tick.count, 1900U);
}

// Images of gloves for VR drivers, and the lines that they send.
class Gloves : public Replay {
 protected:
  deploy::Glove glove(const model::Model& model, const model::Pins& pins) const {
    deploy::Glove g = deploy::glove_for({}, model, study::bench_key());
    g.output = deploy::Output::opengloves;
    g.pins = pins;
    return g;
  }
  // Compares every byte with the host's.
  std::vector<std::string> sent(const deploy::Glove& g, const Counts& counts) const {
    std::vector<std::string> lines;
    EXPECT_EQ(replay(g, counts, &lines).mismatches, 0U);
    EXPECT_GE(lines.size() + 1, counts.size()) << "a line for each sample";
    return lines;
  }
  // Each wired button was down for a quarter of the time, as replay() presses them.
  static void expect_pressed(const std::vector<std::string>& lines) {
    std::array<int, 8> pressed{};
    for (const std::string& line : lines) {
      for (unsigned k = 0; k < 8; ++k) pressed[k] += (parsed(line).values.buttons >> k) & 1;
    }
    for (const model::Button& button : model::buttons())
      EXPECT_NEAR(pressed[static_cast<std::size_t>(std::countr_zero(button.bit))],
                  static_cast<double>(lines.size()) / 4, 10)
          << button.name;
  }
  static link::GloveLine parsed(const std::string& line) {
    link::GloveLine out{};
    EXPECT_EQ(link::parse_gloves(line.data(), static_cast<std::uint16_t>(line.size()), out),
              link::GloveParse::ok)
        << line;
    return out;
  }
};

TEST_F(Gloves, AHundredLinesASecondAreWhatTheDriverReads) {
  const model::Model model = named("published-hw", 100);
  std::array<std::vector<int>, 5> flexion;
  unsigned buttons = 0;
  for (const std::string& line : sent(glove(model, {}), study::gesture_counts(parameters_, model))) {
    EXPECT_NE(line.find("F512G512P"), std::string::npos) << line;
    const link::GloveLine read = parsed(line);
    buttons |= read.values.buttons;
    for (std::size_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(read.has[i]);
      ASSERT_LE(read.values.flexion[i], 1023);
      flexion[i].push_back(read.values.flexion[i]);
    }
  }
  EXPECT_EQ(buttons, link::glove_button::kGrab | link::glove_button::kPinch | link::glove_button::kTrigger);
  for (const std::vector<int>& sent : flexion) {
    EXPECT_LT(std::ranges::min(sent), 30) << "straight";
    EXPECT_GT(std::ranges::max(sent), 990) << "bent";
  }
}

TEST_F(Gloves, ButtonsAndJoystickComeFromTheirPins) {
  const deploy::Glove g = glove(named("published-hw", 100), {{4, 3, 2, 1, 0}, {{6, 7}}, {7, 8, 9, 10, 12}});
  std::array<std::vector<int>, 2> axis;
  const std::vector<std::string> lines = sent(g, exercise(2000, 6));
  expect_pressed(lines);
  for (const std::string& line : lines) {
    for (std::size_t i = 0; i < 2; ++i) axis[i].push_back(parsed(line).values.joystick[i]);
  }
  EXPECT_LT(std::ranges::min(axis[0]), 30);
  EXPECT_GT(std::ranges::max(axis[0]), 990);
  EXPECT_EQ(axis[1], std::vector(lines.size(), 512)) << "near its middle it is there";
}

// Its light on D13 is of the buttons' port.
TEST_F(Gloves, AZeroThatIsSetByAButtonLeavesTheOtherButtonsAlone) {
  model::Model model = named("published-hw", 100);
  for (model::Input& input : model.inputs) input.poses = model::Poses{24, 112};
  expect_pressed(sent(glove(model, {{4, 3, 2, 1, 0}, {}, {7, 8, 9, 10, 12}}), exercise(1000, 6)));
}

TEST_F(Gloves, OnlyWiredButtonsCount) {
  const deploy::Glove g = glove(named("published-hw", 100), {{4, 3, 2, 1, 0}, {}, {{{}, {}, {}, {}, 12}}});
  unsigned buttons = 0;
  for (const std::string& line : sent(g, exercise(600, 7))) buttons |= parsed(line).values.buttons;
  namespace button = link::glove_button;
  EXPECT_EQ(buttons, button::kCalibrate | button::kGrab | button::kPinch | button::kTrigger);
}

TEST_F(Gloves, BetaNamesTheOtherJointsAlsoWhileTheirSensorsAreBroken) {
  model::Model model = named("published-hw", 100);
  model.inputs[3].strip = "ring";
  model.joints[1].name = "index_mcp";
  model.joints[3].name = "index_pip";
  deploy::Glove g = glove(model, {});
  g.encoding = deploy::Encoding::beta;
  EXPECT_EQ(model::missing_fingers(model), std::vector<std::string>{"ring"});
  for (const std::string& line : sent(g, exercise(2000, 8))) {
    const link::GloveLine read = parsed(line);
    EXPECT_EQ(read.values.flexion[3], 0) << "no joint moves it";
    EXPECT_TRUE(read.has_joint[1][2]) << "held, then at rest, as fingers are";
    EXPECT_FALSE(read.has_joint[1][1]) << "the finger's own";
  }
}

// Angles and counts for people and for flexor record.
TEST_F(Gloves, PlainLinesAreATableThatFlexorReads) {
  for (const auto& [output, unit] :
       {std::pair{deploy::Output::text, "deg"}, {deploy::Output::log, "count"}}) {
    deploy::Glove g = glove(named("published-hw", 50), {});
    g.output = output;
    std::string all;
    for (const std::string& line : sent(g, exercise(200, 3))) all += line;
    io::write_file(folder_ / "plain.csv", all);
    const std::string index = fmt::format("index_{}", unit);
    const recording::Recording r = recording::read_csv(folder_ / "plain.csv", {index});
    EXPECT_EQ(r.column(index).unit, unit);
    ASSERT_GT(r.t_s.size(), 150U) << "an angle whose sensor is broken is missing";
    EXPECT_NEAR(std::fmod(r.t_s.back() - r.t_s.front() + 0.01, 0.02), 0.01, 1e-9);
  }
}

TEST_F(Gloves, AGloveThatIsAskedReportsWhichHandItIs) {
  deploy::Glove g = glove(named("published-hw", 100), {});
  g.right_hand = false;
  const Firmware firmware{deploy::glove_flash(g)};
  Board board(firmware);
  std::string sent;
  board.on_byte = [&](Cycles, std::uint8_t byte) { sent += static_cast<char>(byte); };
  board.on_sample = [](Cycles, int channel) { return 500 + channel; };
  for (const char c : std::string("A500B500C500D500E500\n"))
    board.receive(board.now() + 100 * kCyclesPerMs, static_cast<std::uint8_t>(c));
  board.run_until(500 * kCyclesPerMs);
  EXPECT_EQ(sent.find('Z'), std::string::npos) << "forces are no question";
  for (const char c : std::string("(ZA)Z\n"))
    board.receive(board.now() + kCyclesPerMs, static_cast<std::uint8_t>(c));
  board.run_until(1000 * kCyclesPerMs);
  EXPECT_NE(sent.find("\nZ(ZV)1(ZG)0(ZH)0\nA"), std::string::npos) << sent;
}

TEST_F(Replay, SensorsOnOtherPinsAreSentToTheBit) {
  for (const auto& pins : {std::array{4, 3, 2, 1, 0}, std::array{7, 1, 2, 3, 5}}) {
    deploy::Glove glove = glove_of(named("published-hw"));
    glove.pins.strip = pins;
    const GloveFigures f = replay(glove, exercise(1000, 9));
    EXPECT_EQ(f.mismatches, 0U) << pins[0];
    EXPECT_GT(f.frames, 900U) << pins[0];
  }
}

// The button, an open hand, a fist: the angles are again those of the glove that the model was made with, also after the
// supply was off.
TEST_F(Replay, AZeroedGloveReadsAsTheModelsGloveDid) {
  deploy::Glove glove = glove_of(named("published-hw", 50));
  for (auto& input : glove.model.inputs) input.poses = model::Poses{40, 110};
  glove.pins.button[4] = 12;
  glove.key.reset();
  const Firmware firmware{deploy::glove_flash(glove)};
  const deploy::GloveTables tables = deploy::glove_tables(glove);
  const auto counts_at = [&](double alpha) {
    int n = 0;
    while (n < 1023 && tables.calibration[1](static_cast<std::uint16_t>(n)) < 32 * alpha) ++n;
    return n;
  };
  double alpha = 40;  // of the model's glove; this one has slipped
  Board board(firmware);
  board.on_sample = [&](Cycles now, int) {
    return counts_at((alpha - 9) / 1.15) + static_cast<int>(now / kCyclesPerMs / 20 % 2);
  };
  link::Receiver receiver(nullptr);
  board.on_byte = [&](Cycles, std::uint8_t byte) { (void)receiver.receive(byte); };
  const auto run_s = [&](double seconds) {
    board.run_until(board.now() + static_cast<Cycles>(seconds * 1000 * kCyclesPerMs));
  };
  const auto index_deg = [&](double at) {
    alpha = at;
    run_s(2);
    return receiver.frame().angle[1] / 16.0;
  };
  model::HostChain host(deploy::chain_parts(glove));
  std::array<int, 5> counts{};
  double expected_deg = 0;
  for (int k = 0; k < 200; ++k) {
    counts.fill(counts_at(60));
    expected_deg = host.step(counts).angle[1] / 16.0;
  }
  EXPECT_GT(std::abs(index_deg(60) - expected_deg), 5) << "before";
  alpha = 40;
  board.set_pin(12, false);
  run_s(0.2);
  board.set_pin(12, true);
  run_s(3);
  alpha = 110;
  run_s(3.5);
  EXPECT_NEAR(index_deg(60), expected_deg, 1.5);
  board.power_off(board.now() + 100 * kCyclesPerMs);
  run_s(1);
  EXPECT_NEAR(index_deg(60), expected_deg, 1.5) << "it is kept";
}

}  // namespace
}  // namespace flexor::cosim
