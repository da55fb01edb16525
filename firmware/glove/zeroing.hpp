// The button that zeroes a glove without a computer: pressed, then an open hand for three seconds and a fist for three,
// each held for the last two. The board's LED says where it is: slow blinks, open; quick ones, fist; on for two seconds, it is set and kept;
// trembling for two seconds, refused, the old one stays. Pressed once more on the way: given up.
#pragma once

#include "firmware/board.hpp"
#include "runtime/glove/signal_chain.hpp"
#include "runtime/glove/zero_store.hpp"
#include "runtime/sensor/zero.hpp"

namespace flexor {
namespace firmware {

// Config: kRate_hz, start_zero_button(), zero_button().
template <class Config, uint8_t kStrips>
class Zeroing {
 public:
  void start() {
    Config::start_zero_button();
    start_led();
  }

  // A model is there, of which `settings` have the poses: those that were kept for it take effect.
  void load(const glove::ChannelSettings* settings, sensor::Correction* corrections) {
    settings_ = settings;
    corrections_ = corrections;
    uint16_t made_for = 0;
    for (uint8_t i = 0; i < kStrips; ++i) {
      made_for = add(made_for, settings[i].poses.open);
      made_for = add(made_for, settings[i].poses.fist);
    }
    store_.load(eeprom_, made_for, corrections_);
  }

  // One sample; alpha before correction. Whether the corrections are new.
  bool sample(const int16_t* alpha) {
    const bool closed = Config::zero_button();
    if (closed && !closed_) {
      zero_.press();
      samples_ = 0;
    }
    closed_ = closed;
    const sensor::ZeroStage before = zero_.stage();
    const sensor::ZeroStage stage = zero_.step(settings_, alpha);
    if (stage != before) samples_ = 0;
    const bool is_new = stage != before && stage == sensor::ZeroStage::done;
    if (is_new) keep();
    if (samples_ < UINT16_MAX) ++samples_;
    show(stage);
    store_.work(eeprom_);
    return is_new;
  }

 private:
  static uint16_t add(uint16_t crc, int16_t reading) {
    crc = core::crc16_add(crc, static_cast<uint8_t>(reading));
    return core::crc16_add(crc, static_cast<uint8_t>(reading >> 8));
  }

  void keep() {
    for (uint8_t i = 0; i < kStrips; ++i) {
      if (settings_[i].poses.open != settings_[i].poses.fist) corrections_[i] = zero_.corrections()[i];
    }
    store_.save(corrections_);
  }

  void show(sensor::ZeroStage stage) {
    constexpr uint16_t kSecond = Config::kRate_hz;
    constexpr uint16_t kTremble = (kSecond + 9) / 10;
    const bool recent = samples_ <= 2 * kSecond;
    bool on = false;
    if (stage == sensor::ZeroStage::open) on = samples_ / (kSecond / 2) % 2 == 0;
    if (stage == sensor::ZeroStage::fist) on = samples_ / (kSecond / 5) % 2 == 0;
    if (stage == sensor::ZeroStage::done) on = recent;
    if (stage == sensor::ZeroStage::refused) on = recent && samples_ / kTremble % 2 == 0;
    set_led(on);
  }

  Eeprom eeprom_;
  sensor::Zero<kStrips> zero_{Config::kRate_hz};
  glove::ZeroStore<Eeprom, kStrips> store_;
  const glove::ChannelSettings* settings_ = nullptr;
  sensor::Correction* corrections_ = nullptr;
  uint16_t samples_ = 0;  // of the stage
  bool closed_ = false;
};

}  // namespace firmware
}  // namespace flexor
