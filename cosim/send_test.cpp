// `flexor send` through a serial port to a board that runs the glove's firmware behind its bootloader: which model the
// board runs afterwards, to the bit, and what is reported when something is in the way.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "cosim/radio_ear.hpp"
#include "cosim/usb_board_test.hpp"
#include "host/io/serial.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

class SendOverUsb : public OnUsb {
 protected:
  void SetUp() override {
    OnUsb::SetUp();
    if (IsSkipped()) return;
    write(folder_ / "glove.hex", deploy::glove_flash(glove_of(kBefore, key_)));
    deploy::write_key(folder_ / "pair.key", key_);
  }

  static constexpr const char* kBefore = "published_hw";
  static constexpr const char* kAfter = "published_wiener";

  // It keeps its EEPROM from one start to the next.
  UsbBoardSetup board(std::optional<long> unplugged_after = {}) const {
    return {.bootloader = boot(),
            .program = folder_ / "glove.hex",
            .eeprom = folder_ / "eeprom.bin",
            .unplugged_after = unplugged_after};
  }
  Finished send(const std::string& port, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"send", path_of(kAfter), "--port", port});
    if (std::ranges::find(more, "--key") == more.end())
      more.insert(more.end(), {"--key", folder_ / "pair.key"});
    return flexor(more);
  }

  struct Compared {
    int frames = 0;
    int wrong = 0;
  };
  // The board's frames after a start beside what the host computes with this model.
  Compared compare(const std::string& port, const std::string& model) const {
    constexpr std::size_t kSamples = 45;
    const deploy::Glove glove = glove_of(model, key_);
    model::HostChain chain(deploy::chain_parts(glove));
    std::vector<link::Frame> expected;
    for (std::size_t k = 0; k < kSamples; ++k) {
      std::array<int, deploy::kFingers> counts{};
      for (int i = 0; i < deploy::kFingers; ++i) counts[static_cast<std::size_t>(i)] = sensor_counts(k, i);
      expected.push_back(chain.step(counts));
    }
    RadioEar ear(glove.key);
    io::SerialPort line(port, 9600);
    Compared out;
    const auto end = Clock::now() + std::chrono::seconds(7);
    for (auto next = Clock::now(); Clock::now() < end;) {
      if (out.frames == 0 && Clock::now() > next) {
        challenge(line, ear, *glove.key);
        next = Clock::now() + std::chrono::milliseconds(300);
      }
      for (const std::uint8_t byte : line.read(0.05)) {
        if (ear.glove_sent(byte) != link::Received::frame) continue;
        const link::Frame& frame = ear.receiver().frame();
        const std::size_t sample = frame.time_ms / 100U - 1U;
        if (sample >= kSamples) return out;
        ++out.frames;
        if (!std::ranges::equal(frame.angle, expected[sample].angle)) ++out.wrong;
      }
    }
    return out;
  }
  void expect_runs(const std::string& port, const std::string& model) const {
    const Compared c = compare(port, model);
    EXPECT_GT(c.frames, 20);
    EXPECT_EQ(c.wrong, 0) << "of " << c.frames;
  }

 private:
  static void challenge(io::SerialPort& line, RadioEar& ear, const link::Key& key) {
    link::Packet packet;
    for (std::uint8_t i = 0; i < link::kNonceBytes; ++i) packet.body()[i] = i;
    std::vector<std::uint8_t> wire(link::kMaxWire);
    wire.resize(packet.seal({link::Type::challenge, false, false, 0}, link::kNonceBytes, &key, wire.data()));
    for (const std::uint8_t byte : wire) ear.hand_sent(byte);
    line.write(wire);
  }
};

TEST_F(SendOverUsb, TheNewModelRunsWithinFiveSecondsAndAfterARestart) {
  UsbBoard helper(board());
  expect_runs(helper.port(), kBefore);
  const auto begin = Clock::now();
  const Finished r = send(helper.port(), {"--json"});
  const std::chrono::duration<double> took_s = Clock::now() - begin;
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_LT(took_s.count(), 5) << "with the bootloader's second";
  const auto json = nlohmann::json::parse(r.out);
  EXPECT_GT(json.at("took_s"), 1.0) << "9600 baud are not quicker";
  EXPECT_GE(json.at("pieces"), 10) << "of 24 bytes";
  EXPECT_EQ(json.at("bootloader"), false);
  EXPECT_NE(r.err.find("bytes sent: "), std::string::npos) << r.err;
  RecordProperty("figures", r.out);
  expect_runs(helper.port(), kAfter);
  helper.finish();
  UsbBoard again(board());
  expect_runs(again.port(), kAfter);
}

TEST_F(SendOverUsb, APlugPulledOnTheWayLeavesTheOldModelAndASecondRunMends) {
  for (const long bytes : {60, 250, 400}) {
    UsbBoard helper(board(bytes));
    expect_message(send(helper.port()), 1, "it runs its old model; send again");
    helper.finish();
    UsbBoard again(board());
    expect_runs(again.port(), kBefore);
  }
  UsbBoard helper(board());
  EXPECT_EQ(send(helper.port()).status, 0);
  expect_runs(helper.port(), kAfter);
}

TEST_F(SendOverUsb, AWrongKeyIsOneLineAndChangesNothing) {
  const fs::path other = folder_ / "other.key";
  deploy::write_key(other, deploy::key_from_hex("ff0102030405060708090a0b0c0d0e0f"));
  UsbBoard helper(board());
  expect_message(send(helper.port(), {"--key", other}), 2, "the glove has another key, or none: --key FILE");
  expect_runs(helper.port(), kBefore);
}

TEST_F(SendOverUsb, OfManyAtOnceOneGetsThePortAndTheBoardIsReachableAfterwards) {
  UsbBoard helper(board());
  for (int round = 0; round < 2; ++round) {
    std::array<Finished, 4> all;
    {
      std::vector<std::jthread> threads;
      for (Finished& one : all) threads.emplace_back([&] { one = send(helper.port()); });
    }
    EXPECT_EQ(std::ranges::count(all, 0, &Finished::status), 1) << round;
    for (const Finished& one : all)
      if (one.status != 0) expect_message(one, 2, "another flexor listens to it");
    expect_runs(helper.port(), kAfter);
  }
}

}  // namespace
}  // namespace flexor::cosim
