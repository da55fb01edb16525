// The Arduino library: compiled with the packaged core for each of its boards, and run on a simulated Uno.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <vector>

#include "cosim/board.hpp"
#include "cosim/compiled.hpp"
#include "cosim/replay.hpp"
#include "host/deploy/arduino_library.hpp"
#include "host/deploy/hardware.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "runtime/link/opengloves.hpp"
#include "runtime/link/receiver.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;

const fs::path kCore = "/usr/share/arduino/hardware/arduino/avr";

struct Kind {
  const char* mcu;
  const char* variant;
  const char* name;
};

class Arduino : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kCore / "cores/arduino/Arduino.h"))
      GTEST_SKIP() << "arduino-core-avr is not installed: script/bootstrap --dev";
    glove_ = deploy::glove_for({}, model::load(FLEXOR_SOURCE_DIR "/models/published_hw.json"), {});
  }
  // The library that has this example.
  void write(const std::string& example) {
    fs::remove_all(folder_ / "Flexor");
    glove_.output = example == "GloveVr" ? deploy::Output::opengloves : deploy::Output::radio;
    deploy::write_arduino_library(glove_, folder_ / "Flexor");
  }
  Firmware with_core(const std::string& example);

  // The flags of the core's platform.txt, warnings on for what is ours.
  std::vector<std::string> compiler(const Kind& board) const {
    return {"avr-gcc",
            "-Os",
            "-std=gnu++11",
            "-fpermissive",
            "-fno-exceptions",
            "-ffunction-sections",
            "-fdata-sections",
            "-fno-threadsafe-statics",
            "-flto",
            std::string("-mmcu=") + board.mcu,
            "-DF_CPU=16000000L",
            "-DARDUINO=10819",
            std::string("-DARDUINO_AVR_") + board.name,
            "-DARDUINO_ARCH_AVR",
            "-DUSB_VID=0x2341",
            "-DUSB_PID=0x8036",
            "-I",
            kCore / "cores/arduino",
            "-I",
            kCore / "variants" / board.variant,
            "-I" + (folder_ / "Flexor/src").string(),
            "-include",
            "Arduino.h"};
  }

  // As the IDE does it: the sketch becomes C++.
  fs::path sketch(const std::string& name) const {
    const fs::path source = folder_ / (name + ".cpp");
    fs::copy_file(folder_ / "Flexor/examples" / name / (name + ".ino"), source,
                  fs::copy_options::overwrite_existing);
    return source;
  }

  static void run(std::vector<std::string> command, const std::vector<std::string>& more) {
    command.insert(command.end(), more.begin(), more.end());
    const io::ProcessResult result = io::run_process(command);
    EXPECT_EQ(result.status, 0) << result.err;
  }

  deploy::Glove glove_;
  const io::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(Arduino, TheExamplesCompileForEachBoardOfTheCore) {
  for (const Kind& board : {Kind{"atmega328p", "standard", "UNO"}, Kind{"atmega32u4", "leonardo", "LEONARDO"},
                            Kind{"atmega32u4", "micro", "MICRO"}, Kind{"atmega2560", "mega", "MEGA2560"}}) {
    for (const char* name : {"Glove", "GloveRadio", "GloveVr"}) {
      write(name);
      run(compiler(board), {"-Wall", "-Wextra", "-Werror", "-c", sketch(name), "-o", folder_ / "sketch.o"});
    }
  }
}

TEST_F(Arduino, TheVrSketchReadsButtonsAndJoystickWhereTheyAreWired) {
  glove_.pins = {{4, 3, 2, 1, 0}, {{5, 7}}, {7, 8, {}, {}, 12}};
  write("GloveVr");
  const std::string text = io::read_file(folder_ / "Flexor/examples/GloveVr/GloveVr.ino");
  namespace button = link::glove_button;
  EXPECT_NE(text.find("kPins[FlexorGlove::kFingers] = {A4, A3, A2, A1, A0};"), std::string::npos) << text;
  EXPECT_NE(text.find("kJoystick[] = {A5, A7};"), std::string::npos) << text;
  for (const auto& [pin, bit] : {std::pair{7, button::kJoystick}, {8, button::kA}, {12, button::kCalibrate}})
    EXPECT_NE(text.find(fmt::format("{{{}, {}}}", pin, bit)), std::string::npos) << text;
  for (const Kind& board : {Kind{"atmega32u4", "micro", "MICRO"}, Kind{"atmega2560", "mega", "MEGA2560"}})
    run(compiler(board),
        {"-Wall", "-Wextra", "-Werror", "-c", sketch("GloveVr"), "-o", folder_ / "sketch.o"});
}

TEST_F(Arduino, TheRadioIsOpenedAtTheDeploymentsRate) {
  glove_.baud = 38400;
  write("Glove");
  EXPECT_NE(io::read_file(folder_ / "Flexor/examples/Glove/Glove.ino").find("Serial1.begin(38400);"),
            std::string::npos);
  EXPECT_NE(io::read_file(folder_ / "Flexor/examples/GloveRadio/GloveRadio.ino").find("Serial.begin(38400);"),
            std::string::npos);
}

// Arduino.h has a macro of nearly every short name; whoever takes the interpreter into a sketch meets them.
TEST_F(Arduino, TheInterpreterCompilesBehindArduinoH) {
  write("Glove");
  const fs::path source = folder_ / "graph.cpp";
  io::write_file(source, "#include \"runtime/compensator/graph.hpp\"\n");
  run(compiler({"atmega328p", "standard", "UNO"}),
      {"-DFLEXOR_AVR_ASSEMBLY", "-Wall", "-Wextra", "-c", source, "-o", folder_ / "graph.o"});
}

// The sketch with the core that Debian packages.
Firmware Arduino::with_core(const std::string& name) {
  write(name);
  std::vector<std::string> sources = {sketch(name)};
  for (const auto& entry : fs::directory_iterator(kCore / "cores/arduino")) {
    const std::string kind = entry.path().extension();
    if (kind == ".c" || kind == ".cpp" || kind == ".S") sources.push_back(entry.path());
  }
  std::sort(sources.begin() + 1, sources.end());
  std::vector<std::string> command = compiler({"atmega328p", "standard", "UNO"});
  // Assembly wants no Arduino.h, and the example includes Flexor.h. The core wants a name that Debian's compiler lacks.
  command.resize(command.size() - 2);
  command.insert(command.end(), {"-w", "-DDECIMAL_DIG=__DECIMAL_DIG__", "-Wl,--gc-sections"});
  command.insert(command.end(), sources.begin(), sources.end());
  return compiled(command);
}

TEST_F(Arduino, OnASimulatedUnoItSendsTheHostsAnglesToTheBit) {
  const Firmware firmware = with_core("GloveRadio");
  const Counts counts = exercise(150, 3);
  model::HostChain host(deploy::chain_parts(glove_));
  std::vector<link::Frame> expected;
  for (const auto& sample : counts) expected.push_back(host.step(sample));

  Board board(firmware);
  // As `flexor record --readings`: it asks again before the second is over.
  link::Packet packet;
  packet.body()[0] = static_cast<std::uint8_t>(link::Request::readings);
  std::array<std::uint8_t, link::kMaxWire> request{};
  const std::uint8_t request_bytes =
      packet.seal({link::Type::request, false, false, 0}, 1, nullptr, request.data());
  std::size_t conversions = 0;
  board.on_sample = [&](Cycles, int channel) {
    const std::size_t k = std::min(conversions++ / deploy::kFingers, counts.size() - 1);
    return counts[k][static_cast<std::size_t>(channel)];
  };
  link::Receiver receiver(nullptr);
  std::size_t frames = 0;
  std::size_t readings = 0;
  const auto hear_readings = [&] {
    std::uint16_t time_ms = 0;
    std::array<std::uint16_t, deploy::kFingers> sent{};
    link::get_readings(receiver.packet().body(), deploy::kFingers, time_ms, sent.data());
    const std::size_t k = time_ms / 100U - 1U;
    if (k >= counts.size()) return;
    ++readings;
    EXPECT_TRUE(std::ranges::equal(sent, counts[k])) << "sample " << k;
  };
  board.on_byte = [&](Cycles, std::uint8_t byte) {
    link::Received result = receiver.push(byte);
    while (result == link::Received::pending) result = receiver.verify();
    if (result == link::Received::other && receiver.packet().type() == link::Type::readings) hear_readings();
    if (result != link::Received::frame) return;
    const std::size_t k = receiver.frame().time_ms / 100U - 1U;
    if (k >= expected.size()) return;
    ++frames;
    for (std::size_t i = 0; i < deploy::kFingers; ++i) {
      ASSERT_EQ(receiver.frame().angle[i], expected[k].angle[i]) << "sample " << k << ", finger " << i;
      ASSERT_EQ(receiver.frame().status[i], expected[k].status[i]) << "sample " << k << ", finger " << i;
    }
  };
  constexpr Cycles kAsks = 800 * kCyclesPerMs;
  constexpr Cycles kByte = 104 * kCyclesPerMs / 100;  // at 9600 baud
  for (Cycles asked = kAsks; conversions < deploy::kFingers * counts.size();) {
    board.run_until(board.now() + kCyclesPerMs);
    if (board.now() < asked) continue;
    asked += kAsks;
    for (std::uint8_t i = 0; i < request_bytes; ++i)
      board.receive(board.now() + static_cast<Cycles>(i + 1) * kByte, request[i]);
  }
  EXPECT_GT(frames, counts.size() / 2) << "between them the glove listens";
  EXPECT_GT(readings, counts.size() / 2) << "where it was asked";
}

}  // namespace
}  // namespace flexor::cosim
