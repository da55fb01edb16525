// What a model as data brings for the signal chain around it. Settings: of each strip and finger `monitor` (low, high),
// `guard` (rest), `strips` and `poses`, as the chain has them.
#pragma once

#include "runtime/compensator/graph.hpp"
#include "runtime/glove/glove_text.hpp"

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

using OutputSettings = compensator::Output;

// Of each output of the parts that a graph has loaded, as the parts say it: nothing of it is kept. use(OutputSettings).
template <class Place, class Graph, class Use>
void for_each_output(const Graph& graph, Use use) {
  for (uint8_t p = 0; p < graph.parts(); ++p) {
    const uint8_t* const part = graph.part(p);
    const uint8_t* at = part + compensator::kHeaderBytes +
                        compensator::kInputBytes * Place::byte(part + compensator::kInputCount);
    for (uint8_t i = Place::byte(part + compensator::kOutputCount); i > 0;
         --i, at += compensator::kOutputBytes)
      use(OutputSettings::read<Place>(at));
  }
}

// From the open hand to the fist, both Q4; a fist is no less than the top.
inline FlexionSettings flexion_between(int16_t open, int16_t fist) {
  const int32_t top = static_cast<int32_t>(link::kGloveTop) * 0x10000;
  const int32_t width = fist == open ? 1 : static_cast<int32_t>(fist) - open;
  return {open, (top + (width < 0 ? -width : width) - 1) / width};
}

// A further joint's, of a finger's guard.
inline JointSettings joint_settings(const OutputSettings& one, const sensor::GuardSettings& finger) {
  return {one.finger,
          one.place,
          one.strips,
          flexion_between(one.open, one.fist),
          {one.rest, finger.max_step, finger.hold_samples}};
}

}  // namespace glove
}  // namespace flexor
