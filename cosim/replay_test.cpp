// What the glove's image sends equals the host's runtime on the same counts, to the bit, and what it costs.
#include "cosim/replay.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "host/deploy/deploy.hpp"
#include "host/identify/identify_files.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "host/model/channel.hpp"
#include "host/model/wiring.hpp"
#include "host/recording/csv.hpp"
#include "host/study/glove_fit.hpp"
#include "runtime/link/opengloves.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;
using study::GloveFigures;

class Replay : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("flexor_replay_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  struct Built {
    deploy::Glove glove;
    deploy::Image image;
    std::unique_ptr<Firmware> firmware;
  };
  Built build(const model::Model& model, bool assembly = true,
              deploy::Output output = deploy::Output::radio) {
    Built b{study::glove_for(parameters_, model), {}, nullptr};
    b.glove.assembly = assembly;
    b.glove.output = output;
    b.image = deploy::build_glove(b.glove, folder_);
    b.firmware = std::make_unique<Firmware>(b.image.elf);
    return b;
  }
  void expect_exact(const model::Model& model, const Counts& counts, bool assembly = true) {
    const Built b = build(model, assembly);
    const GloveFigures f = replay(*b.firmware, b.glove, counts);
    const auto every = static_cast<std::size_t>(deploy::samples_per_frame(b.glove));
    EXPECT_GE(f.frames + 1, counts.size() / every) << model.name;
    EXPECT_EQ(f.mismatches, 0U) << model.name << (assembly ? "" : " without assembly");
  }
  static model::Model named(const char* name, double rate_hz = 10) {
    return study::compensator(name, rate_hz).model;
  }

  twin::Parameters parameters_ = study::shipped_parameters();
  fs::path folder_;
};

// Curves, plays, motion and a lead for each of five fingers, identified on the twin's glove.
model::Model identified(double rate_hz) {
  study::GloveRequest recorded;
  recorded.parameters = study::shipped_parameters();
  recorded.rate_hz = rate_hz;
  identify::HandRequest request;
  request.rate_hz = rate_hz;
  request.lead_s = 0.1;
  request.structure = "curve(8) + play(0.08) > curve(8) + motion(0.15)";
  for (const std::string& finger : model::finger_names())
    request.map.push_back({finger, {finger + "_alpha_deg"}, finger + "_deg"});
  return identify::fit_hand(request, study::hand_recordings(study::record_glove(recorded)));
}

TEST_F(Replay, TheSixGesturesAreSentToTheBit) {
  for (const char* name : {"raw", "published-w", "published-hw"}) {
    const model::Model model = named(name);
    expect_exact(model, study::gesture_counts(parameters_, model));
  }
}

TEST_F(Replay, ReadingsAllOverTheRangeAreSentToTheBit) {
  for (const char* name : {"raw", "published-w", "published-hw"})
    expect_exact(named(name), exercise(3000, 1));
}

TEST_F(Replay, PortableProductsGiveTheSameBits) {
  for (const char* name : {"published-w", "published-hw"})
    expect_exact(named(name), exercise(3000, 2), false);
  expect_exact(identified(10), exercise(1500, 5), false);
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

// A section of the program that adds up what others made, and reads no strip itself; sensors that name no finger are on
// the strips that are free.
TEST_F(Replay, StripsThatSeveralJointsShareAreSentToTheBit) {
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

// One finger's model: the other four strips are missing.
TEST_F(Replay, AModelOfOneFingerLeavesTheOthersAtRestAndSaysSo) {
  const model::Model all = named("published-hw");
  const Built b = build(model::with_channels(all, {*model::channel(all, 1)}));
  const GloveFigures f = replay(*b.firmware, b.glove, exercise(300, 6));
  EXPECT_EQ(f.mismatches, 0U);
}

class RealReplay : public Replay {
 protected:
  void SetUp() override {
    Replay::SetUp();
    if (!fs::exists(data()))
      GTEST_SKIP() << "needs the recordings in ../shared/data/glove, which are not part of the repository";
  }
  static fs::path data() { return fs::path(FLEXOR_SOURCE_DIR) / "../shared/data/glove"; }

  // A raw log's readings as they came, row by row, on every strip.
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
    identify::FileRequest request;
    request.files = {log, data() / folder / "camera_angles.csv", column, reference};
    request.input_unit = "count";
    request.structure = "hw-hysteresis";
    request.plays = 1;
    const model::Model model = identify::identify_files(request, {}).model;
    expect_exact(model, counts);
  }
}

// The targets of the design, on the simulated ATmega328P: exact and repeatable.
TEST_F(Replay, CyclesAndSizesAreWithinTheirTargets) {
  // Readings that every channel takes, so that none is quick because it refuses.
  Counts counts = exercise(1500, 7);
  for (auto& sample : counts) {
    for (int& n : sample) n = 440 + n % 400;
  }
  struct Case {
    const char* name;
    bool assembly;
    double mean;
    std::uint64_t worst;
  };
  for (const Case& c : {Case{"published-hw", false, 640, 780}, Case{"published-hw", true, 480, 780},
                        Case{"published-w", false, 1400, 1500}, Case{"published-w", true, 900, 1500}}) {
    const Built b = build(named(c.name), c.assembly);
    const GloveFigures f = replay(*b.firmware, b.glove, counts);
    EXPECT_LE(f.step.mean(), c.mean) << c.name;
    EXPECT_LE(f.step.worst, c.worst) << c.name;
    EXPECT_GT(f.step.mean(), 300) << "five channels cannot be this quick";
    EXPECT_LE(b.image.flash_bytes, deploy::kFlashBudget) << c.name;
    EXPECT_LE(b.image.ram_bytes, deploy::kRamBudget) << c.name;
    EXPECT_LT(f.stack_bytes, 400);
    EXPECT_LT(f.awake_share, 0.03) << "the glove should sleep";
  }
  const model::Model model = named("published-hw");
  const deploy::Image hand = deploy::build_hand(study::safe_hand(parameters_, model), folder_);
  EXPECT_LE(hand.flash_bytes, deploy::kFlashBudget);
  EXPECT_LE(hand.ram_bytes, deploy::kRamBudget);
  const study::HandFigures figures =
      measure_hand(Firmware(hand.elf), study::glove_for(parameters_, model), 2);
  EXPECT_LT(figures.tick.worst, 8000U) << "half of a millisecond is left for a tag";
  EXPECT_GT(figures.tick.count, 1900U);
}

TEST_F(Replay, TheTextOutputIsWhatTheDriverReads) {
  const model::Model model = named("published-hw", 50);
  const Built b = build(model, false, deploy::Output::opengloves);
  const Counts counts = study::gesture_counts(parameters_, model);
  std::vector<std::string> lines;
  EXPECT_EQ(replay(*b.firmware, b.glove, counts, &lines).mismatches, 0U);
  EXPECT_GE(lines.size() + 1, counts.size());
  std::array<int, 5> least;
  std::array<int, 5> most{};
  least.fill(1023);
  for (const std::string& line : lines) {
    link::GloveLine parsed{};
    ASSERT_EQ(link::parse_gloves(line.data(), static_cast<std::uint16_t>(line.size()), parsed),
              link::GloveParse::ok)
        << line;
    EXPECT_TRUE(line.ends_with("F512G512\n")) << line;
    for (std::size_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(parsed.has[i]);
      ASSERT_LE(parsed.flexion[i], 1023);
      least[i] = std::min(least[i], static_cast<int>(parsed.flexion[i]));
      most[i] = std::max(most[i], static_cast<int>(parsed.flexion[i]));
    }
  }
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LT(least[i], 30) << i;  // straight
    EXPECT_GT(most[i], 990) << i;  // bent
  }
}

// runtime/link/golden.txt once more, this time its angles, encoded by the microcontroller.
TEST_F(Replay, TheMicrocontrollerSpeaksTheGoldenVectors) {
  std::ifstream file(std::string(FLEXOR_SOURCE_DIR) + "/runtime/link/golden.txt");
  std::string program =
      "#include <avr/io.h>\n#include \"runtime/link/messages.hpp\"\n#include "
      "\"runtime/link/session.hpp\"\nusing namespace flexor::link;\n"
      "static void send(uint32_t counter, bool listens, uint16_t time, const int16_t* angle, const "
      "SensorStatus* "
      "status, uint8_t joints, const Key* key) {\n"
      "  Packet packet;\n  uint8_t wire[kMaxWire];\n"
      "  const uint8_t bytes = put_angles(time, angle, status, joints, packet.body());\n"
      "  const uint8_t size = packet.seal({Type::angles, false, listens, counter}, bytes, key, wire);\n"
      "  for (uint8_t i = 0; i < size; ++i) GPIOR0 = wire[i];\n}\nint main() {\n";
  std::string expected;
  const auto bytes_text = [](const std::string& hex) {
    std::string out;
    for (std::size_t i = 0; i < hex.size(); i += 2) out += "0x" + hex.substr(i, 2) + ",";
    return out;
  };
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    std::string what, pair, nonce, counter, listens, time, joints, wire;
    fields >> what >> pair >> nonce >> counter >> listens >> time >> joints >> wire;
    if (what != "angles") continue;
    expected += wire;
    std::string angles, statuses;
    int count = 0;
    std::istringstream list(joints);
    for (std::string joint; std::getline(list, joint, ','); ++count) {
      const auto slash = joint.find('/');
      angles += joint.substr(0, slash) + ",";
      statuses += "static_cast<SensorStatus>(" + joint.substr(slash + 1) + "),";
    }
    program += fmt::format("  {{ const int16_t a[] = {{{}}};\n    const SensorStatus s[] = {{{}}};\n", angles,
                           statuses);
    if (pair != "-") {
      program += fmt::format(
          "    const Key pair = {{{{{}}}}}; const Nonce nonce = {{{{{}}}}}; Session session;\n"
          "    session.start(nonce); session.derive(pair); session.derive(pair);\n",
          bytes_text(pair), bytes_text(nonce));
    }
    program += fmt::format("    send({}UL, {}, {}U, a, s, {}, {}); }}\n", counter, listens, time, count,
                           pair != "-" ? "&session.key()" : "nullptr");
  }
  program += "  for (;;) {}\n}\n";
  io::write_file(folder_ / "golden.cpp", program);
  const std::string elf = (folder_ / "golden.elf").string();
  const auto built = io::run_process({"avr-g++", "-mmcu=atmega328p", "-Os", "-std=c++14",
                                      "-I" FLEXOR_SOURCE_DIR, (folder_ / "golden.cpp").string(), "-o", elf});
  ASSERT_EQ(built.status, 0) << built.err;
  const Firmware firmware(elf);
  Board board(firmware);
  std::string sent;
  board.on_marker = [&](Cycles, std::uint8_t byte) { sent += fmt::format("{:02x}", byte); };
  board.run_until(100 * kCyclesPerMs);
  EXPECT_EQ(sent, expected);
}

}  // namespace
}  // namespace flexor::cosim
