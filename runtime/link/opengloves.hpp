// The text that VR drivers of the OpenGloves family read over USB at 115200 baud ("alpha encoding").
//
//   frame  = *(key [digits]) LF,   key = "A".."P" | "Z" | "(" 1*(A-Z) ")",   digits = 1*DIGIT
// Fingers A (thumb) to E (pinky), 0 .. 1023, rising with flexion; the joystick F, G always at mid-scale,
// since the driver takes a frame of fingers alone for an empty one. Source: the driver's own parser,
// opengloves-driver at a462ff6.
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

constexpr uint8_t kGloveFingers = 5;
constexpr uint16_t kGloveTop = 1023;
constexpr uint16_t kGloveMiddle = 512;
constexpr uint8_t kMaxGloveText = 5 * 5 + 2 * 4 + 1;

// 0 .. kGloveTop between two angles: (angle - straight) scale / 2^16, angles in Q4 degrees.
inline uint16_t flexion_of(int16_t angle, int16_t straight, uint32_t scale) {
  if (angle <= straight) return 0;
  const uint32_t flexion = (static_cast<uint16_t>(angle - straight) * scale) >> 16;
  return flexion > kGloveTop ? kGloveTop : static_cast<uint16_t>(flexion);
}

// `text` has room for kMaxGloveText; returns the bytes written, no terminating zero. Values above the top are
// taken for it: the driver does not.
inline uint8_t encode_gloves(const uint16_t* flexion, char* text) {
  uint8_t at = 0;
  for (uint8_t key = 0; key < kGloveFingers + 2; ++key) {
    uint16_t value = key < kGloveFingers ? flexion[key] : kGloveMiddle;
    if (value > kGloveTop) value = kGloveTop;
    text[at++] = static_cast<char>('A' + key);
    bool leading = true;
    for (uint16_t power = 1000; power > 0; power = static_cast<uint16_t>(power / 10)) {
      const char digit = static_cast<char>('0' + value / power % 10);
      if (leading && digit == '0' && power > 1) continue;
      leading = false;
      text[at++] = digit;
    }
  }
  text[at++] = '\n';
  return at;
}

// What one line says of the fingers, as the driver reads it.
struct GloveLine {
  bool has[kGloveFingers];
  uint16_t flexion[kGloveFingers];
};

enum class GloveParse : uint8_t {
  ok = 0,
  no_end,      // no line feed
  no_digits,   // an analog key without a number, or with a sign: the driver rejects the whole line
  too_large,   // a number above 65535
  no_fingers,  // fingers alone, without a joystick: taken for empty; or nothing known at all
};

// Buttons (H to O), names in brackets, spaces, carriage returns and unknown keys are passed over.
inline GloveParse parse_gloves(const char* text, uint16_t size, GloveLine& line) {
  line = GloveLine{};
  bool joystick = false;
  bool any = false;
  uint16_t at = 0;
  while (at < size && text[at] != '\n') {
    const char key = text[at++];
    if (key == '(') {
      while (at < size && text[at] != ')' && text[at] != '\n') ++at;
      if (at < size && text[at] == ')') ++at;
      while (at < size && text[at] >= '0' && text[at] <= '9') ++at;
      continue;
    }
    const bool analog = (key >= 'A' && key <= 'G') || key == 'P';
    uint32_t value = 0;
    bool digits = false;
    for (; at < size && text[at] >= '0' && text[at] <= '9'; ++at) {
      value = 10 * value + static_cast<uint32_t>(text[at] - '0');
      digits = true;
      if (value > UINT16_MAX) return GloveParse::too_large;
    }
    if (!analog) continue;
    if (!digits) return GloveParse::no_digits;
    joystick = joystick || key == 'F' || key == 'G';
    if (key > 'E') continue;
    any = true;
    line.has[key - 'A'] = true;
    line.flexion[key - 'A'] = static_cast<uint16_t>(value);
  }
  if (at == size) return GloveParse::no_end;
  return any && joystick ? GloveParse::ok : GloveParse::no_fingers;
}

}  // namespace link
}  // namespace flexor
