// The button that zeroes a glove without a computer: pressed, then an open hand for three seconds and a fist for three,
// each held for the last two. The board's LED shows its stage: slow blinks, open; quick ones, fist; on for two seconds, it is set and kept;
// trembling for two seconds, refused, the old one stays. Pressed once more on the way: given up.
#pragma once

#include "firmware/board.hpp"
#include "runtime/glove/settings.hpp"
#include "runtime/glove/signal_chain.hpp"
#include "runtime/glove/zero_store.hpp"
#include "runtime/sensor/zero.hpp"

namespace flexor {
namespace firmware {

template <uint8_t kSensors>
class Zeroing {
 public:
  // pin: the button's, or none.
  void start(uint8_t pin, uint8_t rate_hz) {
    pin_ = pin;
    second_ = rate_hz;
    zero_ = sensor::Zero<kSensors>(rate_hz);
    if (pin != glove::kNoPin) start_led();
  }

  bool is_there() const { return pin_ != glove::kNoPin; }

  // A model is there, of which `settings` have the poses: those that were kept for it take effect.
  void load(const glove::ChannelSettings* settings, sensor::Correction* corrections) {
    if (!is_there()) return;
    settings_ = settings;
    corrections_ = corrections;
    store_.load(eeprom_, glove::poses_id(settings), corrections_);
  }

  // One sample; alpha before correction. Whether the corrections are new.
  bool sample(const int16_t* alpha) {
    const bool closed = is_closed(pin_);
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
  void keep() {
    for (uint8_t i = 0; i < kSensors; ++i) {
      if (settings_[i].poses.open != settings_[i].poses.fist) corrections_[i] = zero_.corrections()[i];
    }
    store_.save(corrections_);
  }

  void show(sensor::ZeroStage stage) {
    const uint16_t second = second_;
    const uint16_t tremble = (second + 9) / 10;
    const bool recent = samples_ <= 2 * second;
    bool on = false;
    if (stage == sensor::ZeroStage::open) on = samples_ / (second / 2) % 2 == 0;
    if (stage == sensor::ZeroStage::fist) on = samples_ / (second / 5) % 2 == 0;
    if (stage == sensor::ZeroStage::done) on = recent;
    if (stage == sensor::ZeroStage::refused) on = recent && samples_ / tremble % 2 == 0;
    set_led(on);
  }

  Eeprom eeprom_;
  sensor::Zero<kSensors> zero_{0};
  glove::ZeroStore<Eeprom, kSensors> store_;
  const glove::ChannelSettings* settings_ = nullptr;
  sensor::Correction* corrections_ = nullptr;
  uint16_t samples_ = 0;  // of the stage
  uint8_t pin_ = glove::kNoPin;
  uint8_t second_ = 0;  // samples
  bool closed_ = false;
};

}  // namespace firmware
}  // namespace flexor
