// A compensator that is data, with what the signal chain and the lines for VR drivers get from it. Settings: of each sensor and
// finger `monitor` (low, high), `guard` (rest), `sensors` and `poses`, as the chain has them.
#pragma once

#include "runtime/compensator/graph.hpp"

namespace flexor {
namespace glove {

// RAM for a model's states: of an ATmega328P, which a model is checked against. Elsewhere pointers are longer, states are aligned,
// and the Arduino library has more.
constexpr uint16_t kArenaBytes = 552;
constexpr uint16_t kLibraryArenaBytes = sizeof(void*) / 2 * kArenaBytes;

// No sensor: open, always.
template <class Settings>
void clear_settings(Settings* settings) {
  for (uint8_t i = 0; i < compensator::kSensors; ++i) {
    settings[i].monitor.low = settings[i].monitor.high = 0;
    settings[i].guard.rest = 0;
    settings[i].sensors = 0;
    settings[i].poses = {0, 0};
  }
}

// Of a part that has been checked.
template <class Place, class Settings>
void describe(const uint8_t* bytes, Settings* settings) {
  compensator::Bytes<Place> in{bytes + compensator::kHeaderBytes};
  for (uint8_t i = 0; i < Place::byte(bytes + compensator::kInputCount); ++i) {
    Settings& of_sensor = settings[in.u8() & 15];
    in.at += 2;
    of_sensor.monitor.low = in.u16();
    of_sensor.monitor.high = in.u16();
    in.at += 4;
    of_sensor.poses.open = in.i16();
    of_sensor.poses.fist = in.i16();
  }
  for (uint8_t i = Place::byte(bytes + compensator::kOutputCount); i > 0; --i) {
    const compensator::Output one = compensator::Output::read<Place>(in.at);
    in.at += compensator::kOutputBytes;
    if (one.number >= compensator::kFingers) continue;
    settings[one.number].guard.rest = one.rest;
    settings[one.number].sensors = one.sensors;
  }
}

// Place: where the block lies. kArena: bytes for its states.
template <class Place, uint16_t kArena>
class BlockModel : public compensator::Graph<Place, kArena> {
 public:
  // No model: every finger stays at rest and is reported as not sensed.
  template <class Settings>
  void unload(Settings* settings) {
    this->clear();
    clear_settings(settings);
  }

  // `block` outlives this object. Between two samples: every block starts again. Unless it is ok there is no model.
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
