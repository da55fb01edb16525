#include "host/deploy/config.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "host/deploy/compensator_text.hpp"
#include "host/deploy/hardware.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "host/model/channel.hpp"
#include "host/model/correction.hpp"
#include "host/model/random_glove.hpp"
#include "runtime/core/flash_map.hpp"
#include "runtime/glove/glove_text.hpp"

namespace flexor::deploy {
namespace {

namespace fs = std::filesystem;
using io::expect_refused;

Glove glove(double rate_hz = 10) {
  Glove g = glove_for({}, model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json"),
                      key_from_hex("000102030405060708090a0b0c0d0e0f"));
  g.model.sample_period_s = 1 / rate_hz;
  return g;
}

class Deploy : public testing::Test {
 protected:
  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

// Of every kind of block, compiled for the board, and run on this machine.
TEST_F(Deploy, AModelsHeaderIsItsFixedPointToTheBit) {
  std::vector<model::Model> models = {glove().model};
  for (std::size_t kind = 0; kind < std::variant_size_v<model::Kind>; ++kind)
    models.push_back(model::RandomGlove(1).make_with(kind));
  std::string includes, calls;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const std::string name = fmt::format("m{}", i);
    io::write_file(folder_ / (name + ".hpp"), header_text(models[i], name));
    includes += fmt::format("#include \"{}.hpp\"\n", name);
    calls += fmt::format("run<{}::Compensator>();", name);
  }
  const std::string program = (folder_ / "m").string();
  io::write_file(program + ".cpp", includes + R"(#include <stdio.h>
template <class Compensator>
void run() {
  Compensator c;
  for (long k = 0; k < 400; ++k) {
    for (int f = 0; f < 5; ++f) c.alpha[f] = 37 * k * (f + 1) % 5760;
    c.step();
    for (int f = 0; f < 5; ++f) printf("%d ", c.angle[f]);
  }
}
int main() {)" + calls + "}\n");
  for (std::vector<std::string> argv :
       {std::vector<std::string>{"avr-g++", "-mmcu=atmega328p", "-Os", "-c", "-o", program + ".o"},
        {"g++", "-o", program}}) {
    argv.insert(argv.end(), {"-std=c++14", "-Wall", "-Wextra", "-Werror", program + ".cpp"});
    const io::ProcessResult result = io::run_process(argv);
    ASSERT_EQ(result.status, 0) << argv.front() << result.err;
  }
  std::istringstream output(io::run_process({program}).out);
  for (const model::Model& model : models) {
    model::HostCompensator exact(model);
    for (int k = 0; k < 400; ++k) {
      for (int f = 0; f < 5; ++f)
        exact.alpha[static_cast<std::size_t>(f)] = static_cast<std::int16_t>(37 * k * (f + 1) % 5760);
      exact.step();
      for (const std::int16_t angle : exact.angle) {
        int is = 0;
        output >> is;
        ASSERT_EQ(is, angle) << model.blocks[model.blocks.size() / 2].to << ", sample " << k;
      }
    }
  }
}

TEST_F(Deploy, ACorrectionOfASensorCostsTheBoardNothing) {
  const Glove g = glove();
  const model::Correction moved{1.07, -6};
  Glove board = g;
  board.model = model::corrected(g.model, 1, moved);
  fold_corrections(board);
  EXPECT_EQ(board.model.blocks, g.model.blocks);
  for (int n = 304; n < 900; n += 16) {
    EXPECT_NEAR(board.sensor[1](n), moved(g.sensor[1](n)), 1e-9) << n;
    EXPECT_EQ(board.sensor[2](n), g.sensor[2](n)) << n;
  }
  const std::vector<model::Block> folded = board.model.blocks;
  fold_corrections(board);
  EXPECT_EQ(board.model.blocks, folded);
}

TEST_F(Deploy, OneImageTakesAnySettings) {
  // Settings and model change nothing of the image.
  for (const Image* image : {&glove_image(), &hand_image()})
    EXPECT_LE(image->content.bytes.size(), core::kKeyBegin);
  const FlashContent flash = glove_flash(glove());
  const std::vector<std::uint8_t>& image = glove_image().content.bytes;
  EXPECT_TRUE(std::equal(image.begin(), image.end(), flash.bytes.begin()));
  const std::optional<glove::Settings> settings = glove_settings_in(flash);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->head.rate_hz, 10);
  EXPECT_FALSE(glove_settings_in(hand_flash({}))) << "a hand's";
}

TEST_F(Deploy, HasBuildsForFourRatesAndNoOthers) {
  for (const int rate : {10, 20, 50, 100}) EXPECT_EQ(sample_rate_hz(glove(rate).model), rate);
  expect_refused([] { (void)sample_rate_hz(glove(200).model); }, "200 Hz");
}

TEST_F(Deploy, SendsAsManyFramesAsTheRadioCarries) {
  EXPECT_EQ(samples_per_frame(glove(10)), 1);
  EXPECT_EQ(samples_per_frame(glove(20)), 1);
  EXPECT_EQ(samples_per_frame(glove(50)), 2);   // 25 of at most 38
  EXPECT_EQ(samples_per_frame(glove(100)), 4);  // 25
  Glove g = glove(100);
  g.frame_rate_hz = 20;
  EXPECT_EQ(samples_per_frame(g), 5);
  g.frame_rate_hz = 50;
  expect_refused([&] { (void)samples_per_frame(g); }, "do not fit a radio of 9600 baud, which carries 38.4");
  g.key.reset();  // 19 bytes: 50 frames a second
  EXPECT_EQ(samples_per_frame(g), 2);
  g.frame_rate_hz = 30;
  expect_refused([&] { (void)samples_per_frame(g); }, "must divide");
  g = glove(10);
  g.baud = 200;
  expect_refused([&] { (void)samples_per_frame(g); }, "raise radio.baud");
}

// A model of every joint of five fingers, and the thumb's three.
Glove every_joint(double rate_hz) {
  Glove g = glove(rate_hz);
  const std::vector<model::Channel> channels = model::channels(g.model);
  std::vector<model::Joint> joints;
  for (std::size_t f = 0; f < channels.size(); ++f) {
    for (const char* end : {"_mcp", "_pip", "_dip", "_cmc", "_ip"}) {
      model::Joint joint = g.model.joints[f];
      joint.name = channels[f].name + end;
      joints.push_back(joint);
    }
  }
  g.model.joints = joints;
  g.output = Output::opengloves;
  g.encoding = Encoding::beta;
  return g;
}

TEST_F(Deploy, TextIs0AtTheOpenHandAnd1023AtTheFist) {
  Glove g = glove(50);
  g.output = Output::opengloves;
  g.model.joints[0].ends = model::Ends{90, 150};
  g.model.joints[1].ends = model::Ends{20, -70};
  const std::vector<BoardOutput> outputs = outputs_of(g);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto sent = [&](double share) {
      const model::Ends ends = *g.model.joints[i].ends;
      const double angle_deg = ends.open_deg + share * (ends.fist_deg - ends.open_deg);
      const compensator::Output& output = outputs[i].output;
      return link::flexion_of(static_cast<std::int16_t>(16 * angle_deg), output.open,
                              glove::flexion_scale(output.open, output.fist));
    };
    EXPECT_EQ(sent(-0.1), 0);
    EXPECT_EQ(sent(0), 0);
    EXPECT_NEAR(sent(0.5), 511, 1);
    EXPECT_EQ(sent(1), 1023);
  }
}

// As a finger: held, then to rest and back at a bounded speed.
TEST_F(Deploy, BetaJointsAreGuardedWhileASensorIsBroken) {
  constexpr int kStep = 32;
  struct OneJoint {
    std::array<std::int16_t, compensator::kOutputs> angle{};
    static std::uint8_t outputs() { return 1; }
    static compensator::Output output(std::uint8_t) { return {5, 2, 1, 1 << 3, 160, 0, 1023}; }
  } model;
  glove::GloveText text;
  link::Frame frame{};
  const std::uint16_t joystick[2] = {512, 512};
  const auto sent = [&](std::int16_t angle, bool broken) {
    frame.status[3] = broken ? link::SensorStatus::open : link::SensorStatus::ok;
    model.angle[5] = angle;
    char line[glove::GloveText::kRoom];
    const std::uint8_t size = text.step(model, frame, {0, kStep, 25}, joystick, 0, line);
    link::GloveLine read{};
    EXPECT_EQ(link::parse_gloves(line, size, read), link::GloveParse::ok);
    EXPECT_TRUE(read.has_joint[1][2]);
    return static_cast<int>(read.joint[1][2]);
  };
  for (int k = 0; k < 60; ++k) (void)sent(800, false);
  EXPECT_EQ(sent(800, false), 800);
  for (int k = 0; k < 25; ++k) EXPECT_EQ(sent(0, true), 800) << k;
  EXPECT_EQ(sent(0, true), 800 - kStep);
  for (int k = 0; k < 60; ++k) (void)sent(0, true);
  EXPECT_EQ(sent(0, true), 160) << "at rest";
  EXPECT_EQ(sent(800, false), 160 + kStep) << "and back without a jump";
}

TEST_F(Deploy, BetaNamesEachJointOfTheDriversHand) {
  Glove g = every_joint(50);
  std::string keys;
  for (const BoardOutput& o : outputs_of(g)) {
    EXPECT_EQ(o.output.sensors, 1 << o.output.finger);
    if (o.output.number < kFingers) continue;
    keys += g.model.joints[o.joint].name + " " + std::to_string(o.output.finger) +
            std::to_string(o.output.place) + ", ";
  }
  EXPECT_EQ(keys,
            "thumb_cmc 00, thumb_ip 02, index_pip 12, index_dip 13, middle_pip 22, middle_dip 23, ring_pip "
            "32, ring_dip 33, pinky_pip 42, pinky_dip 43, ")
      << "the mcp joints are the fingers' own";
  g.encoding = Encoding::alpha;
  EXPECT_EQ(outputs_of(g).size(), 5U);
}

TEST_F(Deploy, LinesForVrFitTheirPeriod) {
  EXPECT_EQ(line_bytes(every_joint(50)), 139);
  EXPECT_EQ(samples_per_frame(every_joint(50)), 1);
  expect_refused([] { (void)samples_per_frame(every_joint(100)); },
                 "a line of up to 139 bytes takes 12.1 ms at 115200 baud");
  Glove alpha = every_joint(100);
  alpha.encoding = Encoding::alpha;
  EXPECT_EQ(samples_per_frame(alpha), 1);
  EXPECT_NO_THROW((void)glove_flash(every_joint(50)));
}

TEST_F(Deploy, MakesTheUsualBaudRates) {
  EXPECT_EQ(uart_divisor(9600), 207);
  EXPECT_EQ(uart_divisor(115200), 16);
  EXPECT_EQ(uart_divisor(38400), 51);
  expect_refused([] { (void)uart_divisor(1e6 * 1.3); }, "cannot be made");
  expect_refused([] { (void)uart_divisor(0); }, "cannot be made");
}

TEST_F(Deploy, CalibratesThroughTwoPointsOrMore) {
  const Sensor line = {{400, 600}, {30, 110}};
  EXPECT_DOUBLE_EQ(line(400), 30);
  EXPECT_DOUBLE_EQ(line(500), 70);
  EXPECT_DOUBLE_EQ(line(700), 150);
  EXPECT_DOUBLE_EQ(line(300), -10);
  const Sensor curve = {{0, 100, 200}, {0, 10, 40}};
  EXPECT_DOUBLE_EQ(curve(150), 25);
  EXPECT_DOUBLE_EQ(curve(300), 70);
}

TEST_F(Deploy, ReadsACalibrationAndRefusesABadOneByName) {
  const auto load = [&](const std::string& fingers) {
    io::write_file(folder_ / "c.json",
                   R"({"schema": "flexor-calibration", "schema_version": 1, "fingers": {)" + fingers + "}}");
    return load_calibration(folder_ / "c.json").sensor;
  };
  EXPECT_DOUBLE_EQ(load(R"("pointer": {"counts": [400, 600], "value": [30, 110]})")[1].value()(500), 70);
  for (const auto& [fingers, why] : {
           std::pair{R"("ring": {"counts": [1], "value": [1]})", "ring: needs at least two points"},
           {R"("ring": {"counts": [5, 5], "value": [1, 2]})", "must increase"},
           {R"("ring": {"counts": [5, 9, 12], "value": [1, 5, 2]})", "rise or fall"},
           {R"("toe": {"counts": [1, 2], "value": [1, 2]})", "c.json: unknown finger \"toe\""},
           {R"("ring": {"counts": [0, 5e-324], "value": [0, 1]})",
            "c.json: ring: \"counts\" must increase by at least 0.001"},
           {R"("ring": {"counts": [1, 2], "value": [-1e308, 1e308]})",
            "c.json: ring: \"value\" is -1e+308; it must lie between -1e+09 and 1e+09"},
           {R"("pinky": {"counts": [1, 2], "value": [1, 2]}, "little": {"counts": [1, 2], "value": [3, 4]})",
            "c.json: pinky comes twice"},
       })
    expect_refused([&, &fingers = fingers] { load(fingers); }, why);
}

TEST_F(Deploy, TheSensorsRailsLieHalfWayFromWhatTheModelTakes) {
  const GloveTables tables = glove_tables(glove());
  for (int i = 0; i < kFingers; ++i) {
    const auto f = static_cast<std::size_t>(i);
    const auto reads = [&](int n) { return tables.calibration[f](static_cast<std::uint16_t>(n)) / 32.0; };
    EXPECT_LT(reads(2 * tables.monitor[f].low), 0);
    EXPECT_GE(reads(2 * tables.monitor[f].low + 2), 0);
    EXPECT_GE(tables.monitor[f].high, 960);
    EXPECT_EQ(tables.monitor[f].stuck_samples, 20) << "two seconds at 10 Hz";
  }
}

TEST_F(Deploy, RefusesAModelThatIntegersCannotFollow) {
  EXPECT_LT(fixed_point_error(glove().model, {}).worst_deg(), model::kFixedError_deg);
  model::Model steep;
  steep.sample_period_s = 0.1;
  for (model::Channel c : model::channels(glove().model)) {
    c.dead_zone.reset();
    c.input_curve = model::Curve{{890.01, 895.02}, {0, 100}};  // twenty degrees a count, and no bits to spare
    c.saturation = {0, 100};
    model::add(steep, c);
  }
  expect_refused([&] { (void)fixed_point_error(steep, {}); }, "more than the 0.0625 allowed");
}

TEST_F(Deploy, TakesKeysOf32HexadecimalDigitsOnly) {
  EXPECT_EQ(to_hex(key_from_hex("000102030405060708090A0b0c0d0e0f")), "000102030405060708090a0b0c0d0e0f");
  for (const char* bad :
       {"", "00", "000102030405060708090a0b0c0d0e0g", "000102030405060708090a0b0c0d0e0f00"}) {
    expect_refused([&] { (void)key_from_hex(bad); }, "32 hexadecimal digits");
  }
  EXPECT_NE(to_hex(new_key()), to_hex(new_key()));
}

}  // namespace
}  // namespace flexor::deploy
