// The compensator of a glove's image, which is data: the model that was sent last, in EEPROM, else the one that was flashed
// behind the image; and with it everything of the signal chain that depends on the model. Of a model in EEPROM, RAM holds
// everything; of one in flash only the states.
#pragma once

#include "runtime/core/flash_map.hpp"
#include "runtime/glove/block_model.hpp"
#include "runtime/glove/model_store.hpp"

namespace flexor {
namespace glove {

template <class Eeprom, uint16_t kArena>
class GloveModel : public BlockModel<core::Anywhere, kArena> {
  using Base = BlockModel<core::Anywhere, kArena>;

 public:
  // flash: where both copies of the model lie.
  explicit GloveModel(const uint8_t* flash) : flash_(flash) {}

  // CRC-16 of the model in flash that is to run: what was sent to another counts no more. 0: there is none.
  uint16_t flashed() const {
    core::Copy copy[2];
    const uint8_t newest = read(copy);
    return newest < 2 ? copy[newest].crc : 0;
  }

  // Between two samples: every block starts again. Takes some milliseconds. Returns what kept the model in EEPROM from running,
  // or where there is none, the one in flash; without any every finger stays at rest and is reported as not sensed.
  template <class Settings>
  compensator::Loaded load(Eeprom& eeprom, const ModelStore<Eeprom>& store,
                           const compensator::MadeFor& made_for, Settings* settings) {
    const Place sent = store.find(eeprom);
    if (sent.size == 0) return load_flashed(made_for, settings);
    const compensator::Loaded loaded = load_sent(eeprom, sent, made_for, settings);
    if (loaded != compensator::Loaded::ok) load_flashed(made_for, settings);
    return loaded;
  }

 private:
  uint8_t read(core::Copy* copy) const {
    for (uint8_t i = 0; i < 2; ++i)
      copy[i] = core::read_copy(flash_ + i * core::kModelCopy, core::kModelCopy);
    return core::newest_of(copy);
  }

  template <class Settings>
  compensator::Loaded load_sent(Eeprom& eeprom, const Place& sent, const compensator::MadeFor& made_for,
                                Settings* settings) {
    this->unload(settings);
    uint8_t* const bytes = this->reserve(sent.size);
    if (bytes == nullptr) return compensator::Loaded::no_room;
    for (uint16_t i = 0; i < sent.size; ++i) bytes[i] = eeprom.read(static_cast<uint16_t>(sent.address + i));
    asm volatile("" ::: "memory");  // they are read by address
    return Base::load(core::Anywhere::in_ram(bytes), sent.size, made_for, settings);
  }

  // The newest copy that can run.
  template <class Settings>
  compensator::Loaded load_flashed(const compensator::MadeFor& made_for, Settings* settings) {
    core::Copy copy[2];
    read(copy);
    compensator::Loaded loaded = compensator::Loaded::corrupt;
    this->unload(settings);
    for (uint8_t tries = 0; tries < 2; ++tries) {
      const uint8_t newest = core::newest_of(copy);
      if (newest == 2) return loaded;
      loaded = Base::load(copy[newest].bytes, copy[newest].size, made_for, settings);
      if (loaded == compensator::Loaded::ok) return loaded;
      copy[newest].size = 0;
    }
    return loaded;
  }

  const uint8_t* flash_;
};

}  // namespace glove
}  // namespace flexor
