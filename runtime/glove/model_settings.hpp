// What a model as data brings for the signal chain around it. Settings: of each strip and finger `monitor` (low, high),
// `guard` (rest), `strips` and `poses`, as the chain has them.
#pragma once

#include "runtime/compensator/graph.hpp"

namespace flexor {
namespace glove {

// No strip: open, always.
template <class Settings>
void clear_settings(Settings* settings) {
  for (uint8_t i = 0; i < compensator::kStrips; ++i) {
    settings[i].monitor.low = settings[i].monitor.high = 0;
    settings[i].guard.rest = 0;
    settings[i].strips = 0;
    settings[i].poses = {0, 0};
  }
}

// Of a part that has been checked.
template <class Place, class Settings>
void describe(const uint8_t* bytes, Settings* settings) {
  compensator::Bytes<Place> in{bytes + compensator::kHeaderBytes};
  for (uint8_t i = 0; i < Place::byte(bytes + compensator::kInputCount); ++i) {
    Settings& of_strip = settings[in.u8() & 15];
    in.at += 2;
    of_strip.monitor.low = in.u16();
    of_strip.monitor.high = in.u16();
    in.at += 4;
    of_strip.poses.open = in.i16();
    of_strip.poses.fist = in.i16();
  }
  for (uint8_t i = Place::byte(bytes + compensator::kOutputCount); i > 0; --i) {
    const compensator::Output one = compensator::Output::read<Place>(in.at);
    in.at += compensator::kOutputBytes;
    if (one.number >= compensator::kFingers) continue;
    settings[one.number].guard.rest = one.rest;
    settings[one.number].strips = one.strips;
  }
}

}  // namespace glove
}  // namespace flexor
