// The compensator of an image whose model is data: what was sent last, else what is built in, and with it everything
// of the signal chain that depends on the model.
#pragma once

#include "runtime/glove/model_settings.hpp"
#include "runtime/glove/model_store.hpp"

namespace flexor {
namespace glove {

// A part in flash.
struct BuiltIn {
  const uint8_t* bytes;
  uint16_t size;
};

template <class Eeprom, uint8_t kParts, uint16_t kArena>
class DataModel : public compensator::Graph<core::Ram, kArena> {
 public:
  // Takes what is stored where all of it can run, else what is built in. Between two samples: every block starts
  // anew. Returns what kept the stored one from running; ok also where nothing is stored.
  template <class Settings>
  compensator::Loaded load(Eeprom& eeprom, ModelStore<Eeprom, kParts>& store, const BuiltIn* built_in,
                           const compensator::MadeFor& made_for, Settings* settings) {
    const compensator::Loaded loaded = try_load(&eeprom, store, built_in, made_for, settings);
    if (loaded != compensator::Loaded::ok) try_load(nullptr, store, built_in, made_for, settings);
    return loaded;
  }

 private:
  // Without EEPROM: what is built in.
  template <class Settings>
  compensator::Loaded try_load(Eeprom* eeprom, ModelStore<Eeprom, kParts>& store, const BuiltIn* built_in,
                               const compensator::MadeFor& made_for, Settings* settings) {
    this->clear();
    clear_settings(settings);
    for (uint8_t part = 0; part < kParts; ++part) {
      const Place stored = eeprom != nullptr ? store.find(*eeprom, part) : Place();
      const uint16_t size = stored.size > 0 ? stored.size : built_in[part].size;
      uint8_t* const bytes = this->reserve(size);
      if (bytes == nullptr) return compensator::Loaded::no_room;
      for (uint16_t i = 0; i < size; ++i) {
        bytes[i] = stored.size > 0 ? eeprom->read(static_cast<uint16_t>(stored.address + i))
                                   : core::Flash::byte(built_in[part].bytes + i);
      }
      const compensator::Loaded loaded = this->add(bytes, size, made_for);
      if (loaded != compensator::Loaded::ok) return loaded;
      describe<core::Ram>(bytes, settings);
    }
    return compensator::Loaded::ok;
  }
};

}  // namespace glove
}  // namespace flexor
