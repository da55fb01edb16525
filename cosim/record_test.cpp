// `flexor record` and `monitor` on a board that runs its own firmware behind a real bootloader: rate and format are found,
// and what is recorded is what the strips read.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cosim/usb_board_test.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/io.hpp"
#include "host/recording/csv.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;

class Record : public testing::Test {
 protected:
  void SetUp() override {
    FLEXOR_NEEDS_TERMINALS();
    if (!fs::exists(kOldBootloader))
      GTEST_SKIP() << "arduino-core-avr is not installed: script/bootstrap tests";
    build_optiboot("atmega328p", "0x7e00", "0x7ffe", boot());
  }
  fs::path boot() const { return folder_.path() / "boot.hex"; }
  fs::path image(const deploy::Key& key) const {
    deploy::Glove glove;
    glove.model = model::load(std::string(FLEXOR_SOURCE_DIR) + "/models/published_hw.json");
    glove.sensor.fill(deploy::divider(35, 25, 100.0 / 180));
    glove.key = key;
    return written(deploy::glove_flash(glove));
  }
  fs::path hand_image(const deploy::Key& key) const {
    deploy::Hand hand;
    hand.key = key;
    return written(deploy::hand_flash(hand));
  }
  fs::path written(const deploy::FlashContent& content) const {
    io::write_file(folder_.path() / "board.hex", deploy::to_intel_hex(content));
    return folder_.path() / "board.hex";
  }
  io::TemporaryFolder folder_;
};

TEST_F(Record, FindsAGlovesRateAndKeepsItsAngles) {
  UsbBoard board({.bootloader = boot(), .program = image({})});
  const fs::path out = folder_.path() / "log.csv";
  const Finished r = flexor({"record", out.string(), "--port", board.port(), "--for", "2", "--json"});
  ASSERT_EQ(r.exit, 0) << r.err;
  const nlohmann::json said = nlohmann::json::parse(r.out);
  EXPECT_EQ(said.at("baud"), 9600);
  EXPECT_EQ(said.at("format"), "Flexor's frames");
  EXPECT_EQ(said.at("torn"), 0);
  const recording::Recording log = recording::read_csv(out, {"thumb_deg", "pinky_deg"});
  EXPECT_NEAR(static_cast<double>(log.t_s.size()), 21, 3) << "10 Hz";
  EXPECT_NEAR(log.t_s.back(), 2, 0.11);
}

TEST_F(Record, GivesTheStripsReadingsOnDemand) {
  UsbBoard board({.bootloader = boot(), .program = image({})});
  const fs::path out = folder_.path() / "log.csv";
  const Finished r = flexor({"record", out.string(), "--port", board.port(), "--for", "2", "--readings"});
  ASSERT_EQ(r.exit, 0) << r.err;
  const recording::Recording log = recording::read_csv(out, {"thumb_count", "index_count"});
  ASSERT_GT(log.t_s.size(), 10U);
  for (const auto& column : log.columns) {
    for (const double counts : column.value) {
      EXPECT_GE(counts, strip_counts(0, 0));
      EXPECT_LE(counts, strip_counts(0, 0) + 200);
      EXPECT_EQ(std::fmod(counts, 10), 0) << "as the strips read";
    }
  }
}

TEST_F(Record, IsTheHandOfAGloveThatIsPaired) {
  const link::Key key = {{1, 2, 3}};
  const fs::path file = folder_.path() / "pair.key";
  deploy::write_key(file, key);
  UsbBoard board({.bootloader = boot(), .program = image(key)});
  const Finished alone = flexor({"monitor", "--port", board.port(), "--for", "1"});
  expect_says(alone, 2, "waits for its hand");
  const Finished r =
      flexor({"monitor", "--port", board.port(), "--for", "2", "--key", file.string(), "--json"});
  ASSERT_EQ(r.exit, 0) << r.err;
  EXPECT_NEAR(nlohmann::json::parse(r.out).at("rate_hz").get<double>(), 10, 2);
}

TEST_F(Record, ReadsWhatAHandSaysOfItsFingers) {
  UsbBoard board({.bootloader = boot(), .program = hand_image({})});
  const Finished r = flexor({"monitor", "--port", board.port(), "--for", "3", "--json"});
  ASSERT_EQ(r.exit, 0) << r.err;
  const nlohmann::json said = nlohmann::json::parse(r.out);
  EXPECT_EQ(said.at("format"), "a hand's telemetry");
  EXPECT_NEAR(said.at("rate_hz").get<double>(), 2, 0.7);
  EXPECT_EQ(said.at("torn"), 0);
  ASSERT_EQ(said.at("columns").size(), 16U);
  EXPECT_EQ(said.at("columns").at(5).at("name"), "thumb_duty_percent");
  for (std::size_t i = 0; i < 5; ++i) {
    const nlohmann::json& angle = said.at("columns").at(i);
    EXPECT_GT(angle.at("most").get<double>(), angle.at("least").get<double>() + 1);
    const nlohmann::json& duty = said.at("columns").at(5 + i);
    EXPECT_GE(duty.at("least").get<double>(), -100);
    EXPECT_LE(duty.at("most").get<double>(), 100);
    EXPECT_LT(duty.at("most").get<double>(), -50) << "back to where it began, which nothing is below";
  }
}

TEST_F(Record, TellsAHandThatWaitsForItsGlove) {
  UsbBoard board({.bootloader = boot(), .program = hand_image(link::Key{{1, 2, 3}})});
  expect_says(flexor({"monitor", "--port", board.port(), "--for", "1"}), 2, "waits for its glove");
}

}  // namespace
}  // namespace flexor::cosim
