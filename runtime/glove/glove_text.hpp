// From what a frame carries to a line for VR drivers. The same code on the glove and on a PC.
#pragma once

#include "runtime/compensator/graph.hpp"
#include "runtime/link/gestures.hpp"
#include "runtime/link/messages.hpp"
#include "runtime/sensor/guard.hpp"

namespace flexor {
namespace glove {

// 2^16 times the flexion of a step of the angle; towards smaller angles below zero. 0: the ends are the same.
inline int32_t flexion_scale(int16_t open, int16_t fist) {
  const int16_t range = static_cast<int16_t>(fist - open);
  const uint16_t size = static_cast<uint16_t>(range < 0 ? -range : range);
  if (size == 0) return 0;
  constexpr uint32_t kAll = static_cast<uint32_t>(link::kGloveTop) << 16;
  const int32_t scale = static_cast<int32_t>((kAll + size - 1) / size);
  return range < 0 ? -scale : scale;
}

// Joysticks rest a little beside their middle.
inline uint16_t centred(uint16_t counts) {
  constexpr uint16_t kRest = 51;  // counts: a twentieth of the way
  const bool rests = counts > link::kGloveMiddle - kRest && counts < link::kGloveMiddle + kRest;
  return rests ? link::kGloveMiddle : counts;
}

class GloveText {
 public:
  static constexpr uint8_t kMaxJoints = 10;  // beside the fingers
  static constexpr uint8_t kRoom = link::kMaxGloveText + kMaxJoints * link::kMaxJointText;

  // model: uint8_t outputs(), compensator::Output output(uint8_t), int16_t angle[] in Q4 degrees. guard: of all joints, its rest
  // apart. joystick: counts of x and y. pressed: of link::glove_button. `text` has kRoom; returns the bytes written.
  template <class Model>
  uint8_t step(const Model& model, const link::Frame& frame, const sensor::GuardSettings& guard,
               const uint16_t* joystick, uint8_t pressed, char* text) {
    uint8_t bad = 0;
    for (uint8_t i = 0; i < link::kFingers; ++i) {
      if (frame.status[i] != link::SensorStatus::ok) bad = static_cast<uint8_t>(bad | 1 << i);
    }
    link::GloveValues values = {};
    link::GloveJoint joints[kMaxJoints];
    uint8_t there = 0;
    uint8_t count = 0;
    for (uint8_t k = 0; k < model.outputs(); ++k) {
      const compensator::Output joint = model.output(k);
      const int32_t scale = flexion_scale(joint.open, joint.fist);
      if (joint.number < link::kFingers) {
        there = static_cast<uint8_t>(there | 1 << joint.number);
        values.flexion[joint.number] = link::flexion_of(frame.angle[joint.number], joint.open, scale);
      } else if (count < kMaxJoints) {
        const sensor::GuardSettings settings = {joint.rest, guard.max_step, guard.hold_samples};
        if (!begun_) guard_[count].reset(settings);
        const int16_t angle =
            guard_[count].step(settings, (joint.sensors & bad) == 0, model.angle[joint.number]);
        joints[count++] = {joint.finger, joint.place, link::flexion_of(angle, joint.open, scale)};
      }
    }
    begun_ = true;
    for (uint8_t i = 0; i < 2; ++i) values.joystick[i] = centred(joystick[i]);
    values.trigger = link::trigger_pull(values.flexion[1]);
    values.buttons = static_cast<uint8_t>(gestures_.step(values.flexion, there) | pressed);
    return link::encode_gloves(values, joints, count, text);
  }

 private:
  bool begun_ = false;
  sensor::Guard guard_[kMaxJoints];
  link::Gestures gestures_;
};

}  // namespace glove
}  // namespace flexor
