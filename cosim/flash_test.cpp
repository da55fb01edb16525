// `flexor flash` against bootloaders that run on simulated boards: what is in the flash afterwards, whether the image
// starts, and what is reported when something is in the way.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "cosim/replay.hpp"
#include "cosim/usb_board_test.hpp"
#include "host/deploy/flash.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/intel_hex.hpp"
#include "host/deploy/send_pages.hpp"
#include "host/io/io.hpp"
#include "host/io/process.hpp"
#include "runtime/core/flash_map.hpp"

namespace flexor::cosim {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFlashBytes = 32768;

class Flash : public OnUsb {
 protected:
  void SetUp() override {
    if (io::find_program("avrdude").empty())
      GTEST_SKIP() << "avrdude is not installed: script/bootstrap --dev";
    OnUsb::SetUp();
    if (IsSkipped()) return;
    write(folder_ / "new/glove.hex", deploy::glove_flash(published()));
    write(folder_ / "before/glove.hex", deploy::glove_flash(glove_of("published_wiener")));
  }

  static deploy::Glove published() { return glove_of("published_hw"); }
  std::string image() const { return (folder_ / "new/glove.hex").string(); }

  // The flash that `dump` has is the image, the bootloader, and between them what was there before or nothing.
  void expect_written(const fs::path& dump, const fs::path& bootloader) const {
    const std::string flash = io::read_file(dump);
    ASSERT_EQ(flash.size(), kFlashBytes);
    for (const fs::path& hex : {fs::path(image()), bootloader}) {
      const auto generation =
          static_cast<std::uint16_t>(static_cast<std::uint8_t>(flash[core::kModelBegin]) |
                                     static_cast<std::uint8_t>(flash[core::kModelBegin + 1]) << 8);
      const deploy::FlashContent content =
          deploy::with_generation(deploy::read_intel_hex(hex, kFlashBytes), generation);
      EXPECT_TRUE(std::equal(content.bytes.begin() + static_cast<long>(content.begin), content.bytes.end(),
                             flash.begin() + static_cast<long>(content.begin),
                             [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); }))
          << hex;
    }
  }

  // One board, flashed: the image is in it and runs.
  void flash_one(int number) const {
    const fs::path dump = folder_ / fmt::format("flash{}", number);
    UsbBoard board({.bootloader = boot(), .program = folder_ / "before/glove.hex", .flash = dump});
    const Finished r = flexor({"flash", image(), "--port", board.port(), "--json"});
    ASSERT_EQ(r.status, 0) << r.err;  // on a thread: nothing may be thrown
    EXPECT_EQ(nlohmann::json::parse(r.out).at("baud"), 115200);
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    EXPECT_GT(board.finish(), 3) << "the image does not run";
    expect_written(dump, boot());
  }
};

TEST_F(Flash, TwentyOfTwentyAreWrittenComparedAndRun) {
  std::atomic<int> next = 0;
  std::vector<std::jthread> four;
  for (int i = 0; i < 4; ++i) {
    four.emplace_back([&] {
      for (int number = next++; number < 20; number = next++) flash_one(number);
    });
  }
}

TEST_F(Flash, AnOldBootloaderIsFoundAtItsRate) {
  const fs::path dump = folder_ / "flash";
  UsbBoard board({.bootloader = kOldBootloader, .flash = dump});
  EXPECT_EQ(json_of({"flash", folder_ / "new", "--port", board.port()}).at("baud"), 57600);
  board.finish();
  expect_written(dump, kOldBootloader);
}

// A watchdog that bit goes on with 16 ms. Optiboot stops it and starts the program at once; the old loader waits for a
// program longer than that, and so for ever.
TEST_F(Flash, AHungProgramIsBackThroughOptibootAndNotThroughTheOldLoader) {
  UsbBoard optiboot({.bootloader = boot(), .program = image(), .hangs_after_ms = 500});
  UsbBoard old({.bootloader = kOldBootloader, .program = image(), .hangs_after_ms = 500});
  std::this_thread::sleep_for(std::chrono::milliseconds(3000));
  EXPECT_GT(optiboot.finish(), 3);
  EXPECT_EQ(old.finish(), 0);
}

TEST_F(Flash, AnotherChipIsNamedAndNotWritten) {
  const fs::path other = folder_ / "atmega168.hex";
  const fs::path dump = folder_ / "flash";
  build_optiboot("atmega168", "0x3e00", "0x3ffe", other);
  UsbBoard board({.bootloader = other, .mcu = "atmega168", .flash = dump});
  expect_message(flexor({"flash", image(), "--port", board.port()}), 1, "the chip there is 0x1e9406");
  board.finish();
  EXPECT_EQ(io::read_file(dump).substr(0, 0x3e00), std::string(0x3e00, '\xff'));
}

TEST_F(Flash, WhatDoesNotStayIsNoticed) {
  UsbBoard board({.bootloader = boot(), .frozen = true});
  expect_message(flexor({"flash", image(), "--port", board.port()}), 1, "at addr 0x0000");
}

TEST_F(Flash, WithoutABootloaderBothRatesAreTriedAndTheCausesReported) {
  const fs::path loop = folder_ / "loop.hex";
  std::vector<std::uint8_t> bytes(0x7e02, 0xff);
  bytes[0x7e00] = 0xff;  // rjmp .-2
  bytes[0x7e01] = 0xcf;
  io::write_file(loop, deploy::to_intel_hex({bytes, 0x7e00}));
  UsbBoard board({.bootloader = loop});
  expect_message(flexor({"flash", image(), "--port", board.port()}), 1,
                 "no bootloader answers at 115200 and 57600 baud");
}

TEST_F(Flash, APulledPlugEndsIt) {
  UsbBoard board({.bootloader = boot(), .unplugged_after = 3000});
  expect_message(flexor({"flash", image(), "--port", board.port()}), 1,
                 "the bootloader is whole: check cable and supply, then the same once more");
}

TEST_F(Flash, AnInterruptReportsWhatTheBoardHoldsAndASecondRunMends) {
  const fs::path dump = folder_ / "flash";
  UsbBoard board({.bootloader = boot(), .flash = dump});
  const std::string err = (folder_ / "err").string();
  const std::string command = fmt::format(
      "'{0}' flash '{1}' --port {2} 2> '{3}' & until grep -q writing '{3}' || ! kill -0 $!; do sleep 0.1; "
      "done; kill -TERM $!; wait $!",
      fs::absolute(FLEXOR_PROGRAM).string(), image(), board.port(), err);
  (void)std::system(command.c_str());
  EXPECT_NE(io::read_file(err).find("run the same command again"), std::string::npos) << io::read_file(err);
  EXPECT_EQ(flexor({"flash", image(), "--port", board.port()}).status, 0);
  board.finish();
  expect_written(dump, boot());
}

// Two boards that run, with the key that deploy gave them.
class Pair : public Flash {
 protected:
  void SetUp() override {
    Flash::SetUp();
    if (IsSkipped()) return;
    const deploy::Glove glove = glove_of("published_hw", key_);
    write(folder_ / "pair/glove.hex", deploy::glove_flash(glove));
    write(folder_ / "pair/hand.hex", deploy::hand_flash(deploy::safe_hand({}, glove.model, key_)));
  }

  UsbBoardSetup board(const std::string& name) const {
    return {.bootloader = boot(),
            .program = folder_ / "pair" / (name + ".hex"),
            .flash = folder_ / (name + ".bin")};
  }
  deploy::FlashContent flash(const std::string& name) const {
    const std::string bytes = io::read_file(folder_ / (name + ".bin"));
    return {{bytes.begin(), bytes.end()}, 0};
  }
  deploy::Key key_of(const std::string& name) const { return deploy::key_in(flash(name), name); }
  // Nothing but the record differs from the image.
  void expect_else_unchanged(const std::string& name) const {
    const deploy::FlashContent image = deploy::read_image(folder_ / "pair" / (name + ".hex"));
    const deploy::FlashContent now = flash(name);
    const std::size_t record = core::kKeyBegin;
    for (std::size_t i = 0; i < image.bytes.size(); ++i) {
      if (i >= record && i < record + sizeof(link::KeyRecord)) continue;
      ASSERT_EQ(now.bytes[i], image.bytes[i]) << name << i;
    }
  }
  static void expect_key(const deploy::Key& key, const link::Key& wanted) {
    ASSERT_TRUE(key.has_value());
    EXPECT_EQ(deploy::to_hex(*key), deploy::to_hex(wanted));
  }
};

TEST_F(Pair, TwoBoardsGetANewKeyAndRunOn) {
  UsbBoard glove(board("glove"));
  UsbBoard hand(board("hand"));
  const fs::path file = folder_ / "pair.key";
  const Finished r = flexor({"pair", "--glove", glove.port(), "--hand", hand.port(), "--out", file});
  ASSERT_EQ(r.status, 0) << r.err;
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_GT(glove.finish(), 3);
  EXPECT_GT(hand.finish(), 100);
  const link::Key now = deploy::load_key(file);
  EXPECT_NE(deploy::to_hex(now), deploy::to_hex(key_));
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  for (const char* name : {"glove", "hand"}) {
    expect_key(key_of(name), now);
    expect_else_unchanged(name);
  }
}

TEST_F(Pair, AHandThatFailsIsReportedWithTheCommandThatMends) {
  const fs::path file = folder_ / "pair.key";
  UsbBoard glove(board("glove"));
  {
    UsbBoardSetup frozen = board("hand");
    frozen.frozen = true;
    UsbBoard hand(frozen);
    const Finished r = flexor({"pair", "--glove", glove.port(), "--hand", hand.port(), "--out", file});
    expect_message(r, 1, "the glove has the new key, the hand may have either key, or none");
    expect_message(r, 1, fmt::format("flexor pair --key {} --glove {} --hand ", file.string(), glove.port()));
  }
  UsbBoard hand(board("hand"));
  const Finished r = flexor({"pair", "--key", file, "--glove", glove.port(), "--hand", hand.port()});
  EXPECT_EQ(r.status, 0) << r.err;
  glove.finish();
  hand.finish();
  for (const char* name : {"glove", "hand"}) expect_key(key_of(name), deploy::load_key(file));
}

TEST_F(Pair, WhatHoldsNoRecordStopsBeforeAnyKeyIsChanged) {
  const fs::path file = folder_ / "pair.key";
  UsbBoard glove(board("glove"));
  UsbBoard empty({.bootloader = boot()});
  expect_message(flexor({"pair", "--glove", glove.port(), "--hand", empty.port(), "--out", file}), 1,
                 "holds no key record");
  EXPECT_FALSE(fs::exists(file));
  glove.finish();
  expect_key(key_of("glove"), key_);
}

TEST_F(Pair, AKeyThatIsThereIsNeverReplaced) {
  const fs::path file = folder_ / "pair.key";
  deploy::write_key(file, key_);
  expect_message(flexor({"pair", "--glove", "/dev/null", "--hand", "/dev/zero", "--out", file}), 2,
                 "is there already");
  expect_key(deploy::load_key(file), key_);
}

TEST_F(Pair, WhatChangedInADeploymentIsSentAndTheBoardReportsWhatItHolds) {
  deploy::Glove changed = published();
  changed.key = deploy::new_key();
  changed.output = deploy::Output::text;
  write(folder_ / "changed/glove.hex", deploy::glove_flash(changed));
  UsbBoard glove(board("glove"));
  const auto ask = [&] { return json_of({"ports", "--ask", "--port", glove.port()}).at("ports").at(0); };
  const nlohmann::json before = ask();
  EXPECT_EQ(before.at("board"), "glove");
  EXPECT_TRUE(before.at("is_our_image"));
  const auto sent = [&] { return json_of({"send", folder_ / "changed", "--port", glove.port()}).at("sent"); };
  EXPECT_EQ(sent(), nlohmann::json::array({"settings", "key", "model"}));
  const nlohmann::json after = ask();
  EXPECT_NE(after.at("settings_crc16"), before.at("settings_crc16"));
  EXPECT_EQ(sent(), nlohmann::json::array({"model"})) << "another may have been sent into EEPROM";
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_GT(glove.finish(), 3);
  expect_key(key_of("glove"), *changed.key);
  EXPECT_EQ(deploy::glove_settings_in(flash("glove"))->head.output, deploy::Output::text);
}

TEST_F(Pair, AHandsImageIsNotWrittenIntoAGlove) {
  UsbBoard glove(board("glove"));
  expect_message(flexor({"flash", folder_ / "pair", "--board", "hand", "--port", glove.port()}), 2,
                 "is for a hand, and the board is a glove");
  glove.finish();
  expect_else_unchanged("glove");
}

TEST_F(Pair, AnOldImageIsNamedWithTheCommandThatReplacesIt) {
  deploy::FlashContent old = deploy::read_image(folder_ / "pair/glove.hex");
  old.bytes[core::kImageIdBegin + 3] += 1;  // version
  write(folder_ / "old/glove.hex", old);
  UsbBoardSetup setup = board("glove");
  setup.program = folder_ / "old/glove.hex";
  UsbBoard glove(setup);
  const Finished r = flexor({"send", folder_ / "pair", "--board", "glove", "--port", glove.port()});
  expect_message(r, 2, fmt::format("flexor flash {} --board glove", (folder_ / "pair").string()));
  glove.finish();
}

// A model that is too large for EEPROM, into the flash of a glove that runs.
class SendThroughBootloader : public Flash {
 protected:
  void SetUp() override {
    Flash::SetUp();
    if (IsSkipped()) return;
    deploy::Glove glove = published();
    glove.model = with_curves(glove.model, 1);
    write(folder_ / "curves/glove.hex", deploy::glove_flash(glove));
  }

  // The model with a curve of 24 knots before each finger's chain, of which `scale` is the slope.
  static model::Model with_curves(model::Model model, double scale) {
    const std::vector<model::Block> blocks = std::exchange(model.blocks, {});
    for (model::Input& input : model.inputs) {
      model::Curve curve;
      for (int k = 0; k < 24; ++k) {
        curve.x.push_back(input.valid_min + (input.valid_max - input.valid_min) * k / 23);
        curve.y.push_back(scale * curve.x.back());
      }
      model.blocks.push_back({{input.name}, input.name + " curve", curve});
    }
    for (model::Block block : blocks) {
      for (std::string& from : block.from) {
        if (std::ranges::any_of(model.inputs, [&](const model::Input& i) { return i.name == from; }))
          from += " curve";
      }
      model.blocks.push_back(block);
    }
    return model;
  }
};

TEST_F(SendThroughBootloader, TheBoardRunsTheNewModelAndThenTheNext) {
  const fs::path dump = folder_ / "flash";
  const fs::path hex = folder_ / "curves/glove.hex";
  deploy::Glove glove = published();
  deploy::FlashContent before = deploy::read_image(hex);
  before.bytes.resize(0x7e00, 0xff);
  UsbBoard board({.bootloader = boot(), .program = hex, .flash = dump});
  for (const double scale : {0.9, 0.8}) {
    glove.model = with_curves(published().model, scale);
    const fs::path model = folder_ / "model.json";
    model::save(glove.model, model);
    const nlohmann::json report = json_of({"send", model, "--port", board.port()});
    EXPECT_EQ(report.at("bootloader"), true);
    EXPECT_FALSE(report.contains("pieces"));
    std::printf("%d bytes through the bootloader: %.1f s\n", report.at("bytes").get<int>(),
                report.at("took_s").get<double>());
    const deploy::FlashContent pages = deploy::pages_with_model(before, glove, "the board");
    std::copy(pages.bytes.begin() + static_cast<long>(pages.begin), pages.bytes.end(),
              before.bytes.begin() + static_cast<long>(pages.begin));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_GT(board.finish(), 3) << "the image does not run";
  const std::string flash = io::read_file(dump);
  for (std::size_t i = 0; i < 0x7e00; ++i)
    ASSERT_EQ(static_cast<std::uint8_t>(flash[i]), before.bytes[i]) << "byte " << i;
}

TEST_F(Flash, MonitorReadsWhatAHandReportsOfItsFingers) {
  write(folder_ / "hand.hex", deploy::hand_flash({}));
  UsbBoard board({.bootloader = boot(), .program = folder_ / "hand.hex"});
  const nlohmann::json report = json_of({"monitor", "--port", board.port(), "--for", "3"});
  EXPECT_EQ(report.at("format"), "a hand's telemetry");
  EXPECT_NEAR(report.at("rate_hz").get<double>(), 2, 0.7);
  EXPECT_EQ(report.at("torn"), 0);
  ASSERT_EQ(report.at("columns").size(), 16U);
  EXPECT_EQ(report.at("columns").at(5).at("name"), "thumb_duty_percent");
  for (std::size_t i = 0; i < 5; ++i) {
    const nlohmann::json& angle = report.at("columns").at(i);
    EXPECT_GT(angle.at("most").get<double>(), angle.at("least").get<double>() + 1);
    const nlohmann::json& duty = report.at("columns").at(5 + i);
    EXPECT_GE(duty.at("least").get<double>(), -100);
    EXPECT_LE(duty.at("most").get<double>(), 100);
    EXPECT_LT(duty.at("most").get<double>(), -50) << "back to where it began, which nothing is below";
  }
}

}  // namespace
}  // namespace flexor::cosim
