// Any text: no crash, and what parses survives the way back out and in again.
#include <stddef.h>
#include <stdlib.h>

#include "runtime/link/opengloves.hpp"

namespace {

using namespace flexor::link;

uint16_t limited(uint16_t value) { return value > kGloveTop ? kGloveTop : value; }

void check_information(const GloveLine& line) {
  char text[kMaxInformationText];
  const uint8_t bytes = encode_glove_information(line.version, line.hand == 1, text);
  GloveLine again;
  if (bytes > kMaxInformationText || parse_gloves(text, bytes, again) != GloveParse::information) abort();
  if (again.version != limited(line.version) || again.hand != (line.hand == 1)) abort();
}

uint8_t joints_of(const GloveLine& line, GloveJoint* joints) {
  uint8_t count = 0;
  for (uint8_t f = 0; f < kGloveFingers; ++f) {
    for (uint8_t p = 0; p < kGlovePlaces; ++p) {
      if (line.has_joint[f][p]) joints[count++] = {f, p, line.joint[f][p]};
    }
  }
  return count;
}

void check_same(const GloveLine& line, const GloveLine& again) {
  for (uint8_t f = 0; f < kGloveFingers; ++f) {
    if (again.values.flexion[f] != limited(line.values.flexion[f])) abort();
    for (uint8_t p = 0; p < kGlovePlaces; ++p) {
      if (again.has_joint[f][p] != line.has_joint[f][p]) abort();
      if (again.joint[f][p] != limited(line.joint[f][p])) abort();
    }
  }
  for (uint8_t i = 0; i < 2; ++i) {
    if (again.values.joystick[i] != limited(line.values.joystick[i])) abort();
  }
  if (again.values.trigger != limited(line.values.trigger)) abort();
  if (again.values.buttons != line.values.buttons) abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size > 1000) return 0;
  GloveLine line;
  const GloveParse parsed =
      parse_gloves(reinterpret_cast<const char*>(data), static_cast<uint16_t>(size), line);
  if (parsed == GloveParse::information) check_information(line);
  if (parsed != GloveParse::ok) return 0;
  constexpr uint8_t kJoints = kGloveFingers * kGlovePlaces;
  GloveJoint joints[kJoints];
  const uint8_t count = joints_of(line, joints);
  char text[kMaxGloveText + kJoints * kMaxJointText];
  const uint8_t bytes = encode_gloves(line.values, joints, count, text);
  GloveLine again;
  if (bytes > kMaxGloveText + count * kMaxJointText || parse_gloves(text, bytes, again) != GloveParse::ok)
    abort();
  check_same(line, again);
  return 0;
}
