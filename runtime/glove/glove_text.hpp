// From what a frame says to a line for VR drivers. The same code on the glove and on a PC.
#pragma once

#include "runtime/link/gestures.hpp"
#include "runtime/link/messages.hpp"
#include "runtime/sensor/guard.hpp"

namespace flexor {
namespace glove {

// A joint's flexion is 0 at `straight`, Q4 degrees, and grows by scale / 2^16 with each step of the angle.
struct FlexionSettings {
  int16_t straight;
  int32_t scale;
};

// A joint of the model beside its fingers' (encoding "beta").
struct JointSettings {
  uint8_t finger;
  uint8_t place;
  uint8_t strips;  // a bit for each strip that the joint's angle needs
  FlexionSettings flexion;
  sensor::GuardSettings guard;  // as its finger's: what is sent while a strip is broken
};

// Joysticks rest a little beside their middle.
inline uint16_t centred(uint16_t counts) {
  constexpr uint16_t kRest = 51;  // counts: a twentieth of the way
  const bool rests = counts > link::kGloveMiddle - kRest && counts < link::kGloveMiddle + kRest;
  return rests ? link::kGloveMiddle : counts;
}

template <uint8_t kMaxJoints>
class GloveText {
 public:
  static constexpr uint8_t kRoom = link::kMaxGloveText + kMaxJoints * link::kMaxJointText;

  // fingers: kFingers settings; joints: `count`, at most kMaxJoints; both outlive this object. there: a bit
  // for each finger of the model.
  GloveText(const FlexionSettings* fingers, const JointSettings* joints, uint8_t count, uint8_t there)
      : fingers_(fingers), joints_(joints), count_(count), gestures_(there) {
    for (uint8_t k = 0; k < count_; ++k) guard_[k].reset(joints_[k].guard);
  }

  // joint_angle: `count`, Q4 degrees. joystick: counts of x and y. pressed: of link::glove_button. `text` has
  // kRoom; returns the bytes written.
  uint8_t step(const link::Frame& frame, const int16_t* joint_angle, const uint16_t* joystick,
               uint8_t pressed, char* text) {
    link::GloveValues values;
    uint8_t bad = 0;
    for (uint8_t i = 0; i < link::kFingers; ++i) {
      values.flexion[i] = link::flexion_of(frame.angle[i], fingers_[i].straight, fingers_[i].scale);
      if (frame.status[i] != link::SensorStatus::ok) bad = static_cast<uint8_t>(bad | 1 << i);
    }
    for (uint8_t i = 0; i < 2; ++i) values.joystick[i] = centred(joystick[i]);
    values.trigger = link::trigger_pull(values.flexion[1]);
    values.buttons = static_cast<uint8_t>(gestures_.step(values.flexion) | pressed);
    link::GloveJoint joints[kMaxJoints + 1];
    for (uint8_t k = 0; k < count_; ++k) {
      const JointSettings& joint = joints_[k];
      const int16_t angle = guard_[k].step(joint.guard, (joint.strips & bad) == 0, joint_angle[k]);
      joints[k] = {joint.finger, joint.place,
                   link::flexion_of(angle, joint.flexion.straight, joint.flexion.scale)};
    }
    return link::encode_gloves(values, joints, count_, text);
  }

 private:
  const FlexionSettings* fingers_;
  const JointSettings* joints_;
  uint8_t count_;
  sensor::Guard guard_[kMaxJoints + 1];
  link::Gestures gestures_;
};

}  // namespace glove
}  // namespace flexor
