// A model into pages of flash: whatever of it has been written when power goes, a whole model runs.
#include "host/deploy/send_pages.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "host/deploy/gloves_test.hpp"
#include "host/deploy/images.hpp"
#include "host/deploy/model_block.hpp"
#include "host/deploy/pair_key.hpp"
#include "host/io/expect_test.hpp"
#include "runtime/core/flash_map.hpp"
#include "runtime/glove/glove_model.hpp"

namespace flexor::deploy {
namespace {

// Erased.
struct NoEeprom {
  std::uint8_t read(std::uint16_t) const { return 0xff; }
};

// The middle finger's angle, Q4, of whichever model the flash starts; -1: none.
int angle_of(const FlashContent& flash, const Glove& glove) {
  const auto ids = calibration_ids(glove_tables(glove));
  glove::GloveModel<NoEeprom, 20000> model(flash.bytes.data() + core::kModelBegin);
  glove::ChannelSettings settings[kFingers] = {};
  NoEeprom eeprom;
  const glove::ModelStore<NoEeprom> store(model.flashed());
  if (model.load(eeprom, store, {ids.data(), 50}, settings) != compensator::Loaded::ok) return -1;
  EXPECT_EQ(settings[2].sensors, 1 << 2);
  for (std::int16_t& alpha : model.alpha) alpha = 32 * 600;
  EXPECT_EQ(model.step(), 31);
  return model.angle[2];
}

int angle_of(const Glove& glove) {
  model::HostCompensator host(glove.model);
  host.alpha.fill(32 * 600);
  host.step();
  return host.angle[2];
}

void put(FlashContent& flash, const FlashContent& pages, std::size_t end) {
  std::copy(pages.bytes.begin() + static_cast<long>(pages.begin),
            pages.bytes.begin() + static_cast<long>(end),
            flash.bytes.begin() + static_cast<long>(pages.begin));
}
void put(FlashContent& flash, const FlashContent& pages) { put(flash, pages, pages.bytes.size()); }

// `visit` gets the flash as it is where power is lost, byte by byte; after it `flash` holds the pages.
template <class Visit>
void for_each_loss(FlashContent& flash, const FlashContent& pages, const Visit& visit) {
  const FlashContent before = flash;
  for (std::size_t end = pages.begin; end <= pages.bytes.size(); end += end % 16 == 0 ? 1 : 15) {
    SCOPED_TRACE(end - pages.begin);
    flash = before;
    // A page is erased as a whole before it is written.
    const std::size_t page = end / core::kFlashPage * core::kFlashPage;
    if (page < pages.bytes.size())
      std::fill_n(flash.bytes.begin() + static_cast<long>(page), core::kFlashPage, 0xff);
    put(flash, pages, end);
    visit(flash);
  }
}

TEST(SendPages, PowerThatIsLostAnywhereLeavesTheOldModelOrTheNew) {
  const Glove old = glove_of_shared_knots(12, 2, 60);
  const Glove now = glove_of_shared_knots(12, 2, 90);
  ASSERT_NE(angle_of(old), angle_of(now));
  FlashContent before = glove_flash(old);
  before.bytes.resize(core::kDataEnd, 0xff);
  const FlashContent pages = pages_with_model(before, now, "the board");
  EXPECT_EQ(pages.begin % core::kFlashPage, 0U);
  EXPECT_EQ(pages.bytes.size() % core::kFlashPage, 0U);
  int new_ones = 0;
  for_each_loss(before, pages, [&](const FlashContent& flash) {
    const int angle = angle_of(flash, old);
    ASSERT_TRUE(angle == angle_of(old) || angle == angle_of(now));
    new_ones += angle == angle_of(now) ? 1 : 0;
  });
  EXPECT_GT(new_ones, 0) << "the last of them are only filling";
  EXPECT_LT(new_ones, 40);
}

template <class Settings>
Settings settings_in(const FlashContent& flash) {
  const Settings* found = core::find_settings<Settings>(flash.bytes.data());
  return found == nullptr ? Settings{} : *found;
}

template <class Settings>
bool is_same(const Settings& a, const Settings& b) {
  return std::memcmp(&a, &b, sizeof(a)) == 0;
}

// Settings that replace others, wherever power is lost; `check` sees the flash each time.
template <class Settings, class Check>
void replace_settings(FlashContent flash, const FlashContent& wanted, const Check& check) {
  flash.bytes.resize(core::kDataEnd, 0xff);
  const Settings old = settings_in<Settings>(flash);
  const Settings now = settings_in<Settings>(wanted);
  ASSERT_FALSE(is_same(old, now));
  int new_ones = 0;
  for (const BlockPages& block : pages_with_blocks(flash, wanted, "OUT")) {
    for_each_loss(flash, block.pages, [&](const FlashContent& lost) {
      const Settings there = settings_in<Settings>(lost);
      ASSERT_TRUE(is_same(there, old) || is_same(there, now));
      new_ones += is_same(there, now) ? 1 : 0;
      check(lost);
      // Whatever was lost, the same command once more ends where it should.
      FlashContent again = lost;
      for (const BlockPages& rest : pages_with_blocks(lost, wanted, "OUT")) put(again, rest.pages);
      ASSERT_TRUE(is_same(settings_in<Settings>(again), now));
      for (const BlockPages& left : pages_with_blocks(again, wanted, "OUT")) ASSERT_EQ(left.what, "model");
    });
  }
  EXPECT_GT(new_ones, 10);
}

TEST(SendPages, PowerThatIsLostAnywhereLeavesTheOldSettingsOrTheNewAndTheModel) {
  const Glove old = glove_of_shared_knots(12, 2, 60);
  Glove now = old;
  now.output = Output::text;
  const int angle = angle_of(old);
  for (int model = 0; model < 3; ++model) {  // a board whose first copy runs, then its second, then its first
    FlashContent flash = glove_flash(old);
    for (int k = 0; k < model; ++k)
      put(flash, pages_with_model(flash, glove_of_shared_knots(12, 2, 61 + k), "the board"));
    FlashContent wanted = glove_flash(now);
    const int runs = angle_of(flash, old);
    replace_settings<glove::Settings>(flash, wanted, [&](const FlashContent& lost) {
      const int is = angle_of(lost, old);
      ASSERT_TRUE(is == runs || is == angle);
    });
  }
}

TEST(SendPages, AHandsSettingsLikewise) {
  Hand hand;
  hand.lower_deg.fill(28);
  hand.upper_deg.fill(113);
  hand.rest_deg.fill(29);
  Hand now = hand;
  now.upper_deg.fill(100);
  replace_settings<hand::Settings>(hand_flash(hand), hand_flash(now), [](const FlashContent&) {});
}

TEST(SendPages, ABoardReportsWhatItHolds) {
  const Glove glove = glove_of_shared_knots(12, 2, 60);
  FlashContent flash = glove_flash(glove);
  const std::optional<BoardContents> contents = contents_of(flash);
  ASSERT_TRUE(contents && contents->settings && contents->model);
  EXPECT_EQ(contents->board, link::BoardKind::glove);
  EXPECT_EQ(contents->version, contents_of(hand_flash({}))->version);
  EXPECT_TRUE(contents->is_our_image);
  EXPECT_NE(contents_of(glove_flash(glove_of_shared_knots(12, 2, 61)))->model, contents->model);
  flash.bytes[0x1000] ^= 1;
  EXPECT_FALSE(contents_of(flash)->is_our_image);
  EXPECT_THROW((void)pages_with_blocks(flash, glove_flash(glove), "OUT"), io::InputError);
  EXPECT_THROW((void)pages_with_blocks(hand_flash({}), glove_flash(glove), "OUT"), io::InputError);
  EXPECT_FALSE(contents_of({std::vector<std::uint8_t>(32768, 0xff), 0}));
}

TEST(SendPages, TheNextOneGoesOverTheOldest) {
  FlashContent flash = glove_flash(glove_of_shared_knots(12, 2, 60));
  flash.bytes.resize(core::kDataEnd, 0xff);
  std::size_t last = 0;
  for (int k = 0; k < 70000; k += k < 4 ? 1 : 9001) {  // generations that wrap around, too
    const Glove now = glove_of_shared_knots(12, 2, 60 + k % 50);
    const FlashContent pages = pages_with_model(flash, now, "the board");
    EXPECT_NE(pages.begin, last);
    last = pages.begin;
    put(flash, pages);
    EXPECT_EQ(angle_of(flash, now), angle_of(now)) << k;
  }
}

TEST(SendPages, WhatDoesNotFitIsReportedWithTheMend) {
  const Glove good = glove_of_shared_knots(12, 2, 60);
  const auto expect = [&](const FlashContent& flash, const Glove& glove, const std::string& what) {
    io::expect_refused([&] { (void)pages_with_model(flash, glove, "the board"); }, what);
  };
  const FlashContent flash = glove_flash(good);
  Glove slow = good;
  slow.model.sample_period_s = 0.1;
  expect(flash, slow, "--rate 50");
  Glove other = good;
  other.sensor[2] = divider(35, 25, 100.0 / 180);
  expect(flash, other, "middle: the board has another calibration");
  FlashContent damaged = flash;
  damaged.bytes[core::kSettingsBegin + 20] ^= 1;
  expect(damaged, good, "holds no settings of this Flexor");
  Glove with_key = good;
  with_key.key = key_from_hex("000102030405060708090a0b0c0d0e0f");
  FlashContent guarded = flash;
  const auto give = [&](const Key& key) { put(guarded, page_with_key(key)); };
  give({});
  expect(guarded, with_key, "the board has no key");
  give(key_from_hex("000102030405060708090a0b0c0d0e0e"));
  expect(guarded, with_key, "the board has another key: --key FILE");
  EXPECT_NO_THROW((void)pages_with_model(guarded, good, "the board")) << "none was given";
  give(with_key.key);
  EXPECT_NO_THROW((void)pages_with_model(guarded, with_key, "the board"));
  expect({std::vector<std::uint8_t>(32768, 0xff), 0}, good, "holds no settings of this Flexor");
}

}  // namespace
}  // namespace flexor::deploy
