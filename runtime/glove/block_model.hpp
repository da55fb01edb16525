// A compensator that is data, with what the signal chain and the lines for VR drivers get from it.
#pragma once

#include "runtime/glove/model_settings.hpp"

namespace flexor {
namespace glove {

// RAM for a model's states: of an ATmega328P, which a model is checked against. Elsewhere pointers are longer, states are aligned,
// and the Arduino library has more.
constexpr uint16_t kArenaBytes = 552;
constexpr uint16_t kLibraryArenaBytes = sizeof(void*) / 2 * kArenaBytes;

// Place: where the block lies. kArena: bytes for its states.
template <class Place, uint16_t kArena>
class BlockModel : public compensator::Graph<Place, kArena> {
 public:
  // No model: every finger stays at rest and says that it is not sensed.
  template <class Settings>
  void unload(Settings* settings) {
    this->clear();
    clear_settings(settings);
  }

  // `block` outlives this object. Between two samples: every block starts anew. Unless it is ok there is no model.
  template <class Settings>
  FLEXOR_SHARED compensator::Loaded load(const uint8_t* block, uint16_t size,
                                         const compensator::MadeFor& made_for, Settings* settings) {
    const compensator::Loaded loaded = this->add(block, size, made_for);
    if (loaded == compensator::Loaded::ok) describe<Place>(block, settings);
    if (loaded != compensator::Loaded::ok) unload(settings);
    return loaded;
  }
};

}  // namespace glove
}  // namespace flexor
