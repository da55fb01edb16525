// The text that VR drivers of the OpenGloves family read over USB at 115200 baud.
//
//   frame  = *(key [digits]) LF,   key = "A".."P" | "Z" | "(" 1*(A-Z) ")",   digits = 1*DIGIT
// Fingers A (thumb) to E (pinky) and joints (xAy), 0 .. 1023, rising with flexion; the joystick F, G, always there and
// at mid-scale where there is none, since the driver takes a frame of straight fingers alone for an empty one; the
// trigger's pull P; H to O are true by being there. Z is not a frame: what the glove is. Source: the driver's own
// parser, opengloves-driver at a462ff6, which calls all of this the alpha encoding.
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

constexpr uint8_t kGloveFingers = 5;
constexpr uint8_t kGlovePlaces = 4;  // joints of a finger, from the wrist: (xAA) .. (xAD)
constexpr uint16_t kGloveTop = 1023;
constexpr uint16_t kGloveMiddle = 512;
constexpr uint8_t kMaxGloveText = 5 * 5 + 3 * 5 + 8 + 1;  // without joints
constexpr uint8_t kMaxJointText = 9;                      // of each joint
constexpr uint8_t kMaxInformationText = 20;

// Bit k is key 'H' + k.
namespace glove_button {
constexpr uint8_t kJoystick = 0x01;
constexpr uint8_t kTrigger = 0x02;
constexpr uint8_t kA = 0x04;
constexpr uint8_t kB = 0x08;
constexpr uint8_t kGrab = 0x10;
constexpr uint8_t kPinch = 0x20;
constexpr uint8_t kMenu = 0x40;
constexpr uint8_t kCalibrate = 0x80;
}  // namespace glove_button

// All 0 .. kGloveTop.
struct GloveValues {
  uint16_t flexion[kGloveFingers];
  uint16_t joystick[2];
  uint16_t trigger;
  uint8_t buttons;
};

// A joint beside its finger: the driver takes it instead of the finger's flexion for one bone.
struct GloveJoint {
  uint8_t finger;  // 0 .. 4
  uint8_t place;   // 0 .. 3
  uint16_t flexion;
};

// 0 .. kGloveTop between two angles: (angle - straight) scale / 2^16, angles in Q4 degrees. Below zero: a joint that closes
// towards smaller angles.
inline uint16_t flexion_of(int16_t angle, int16_t straight, int32_t scale) {
  const bool falls = scale < 0;
  if (falls ? angle >= straight : angle <= straight) return 0;
  const uint16_t bent = static_cast<uint16_t>(falls ? straight - angle : angle - straight);
  const uint32_t flexion = (bent * static_cast<uint32_t>(falls ? -scale : scale)) >> 16;
  return flexion > kGloveTop ? kGloveTop : static_cast<uint16_t>(flexion);
}

// Writes a number behind what stands at `text`; values above the top are taken for it: the driver does not.
inline char* write_glove_number(char* text, uint16_t value) {
  if (value > kGloveTop) value = kGloveTop;
  constexpr uint16_t kPowers[] = {1000, 100, 10};
  bool leading = true;
  for (const uint16_t power : kPowers) {
    char digit = '0';
    for (; value >= power; ++digit) value = static_cast<uint16_t>(value - power);  // a division takes longer
    if (leading && digit == '0') continue;
    leading = false;
    *text++ = digit;
  }
  *text++ = static_cast<char>('0' + value);
  return text;
}

inline char* write_glove_value(char* text, char key, uint16_t value) {
  *text++ = key;
  return write_glove_number(text, value);
}

// `text` has room for kMaxGloveText and kMaxJointText for each of `count` joints, at most 20; returns the bytes
// written, no terminating zero.
inline uint8_t encode_gloves(const GloveValues& values, const GloveJoint* joints, uint8_t count, char* text) {
  char* at = text;
  for (uint8_t i = 0; i < kGloveFingers; ++i)
    at = write_glove_value(at, static_cast<char>('A' + i), values.flexion[i]);
  at = write_glove_value(at, 'F', values.joystick[0]);
  at = write_glove_value(at, 'G', values.joystick[1]);
  at = write_glove_value(at, 'P', values.trigger);
  for (uint8_t k = 0; k < 8; ++k) {
    if (values.buttons & (1 << k)) *at++ = static_cast<char>('H' + k);
  }
  for (uint8_t i = 0; i < count; ++i) {
    *at++ = '(';
    *at++ = static_cast<char>('A' + joints[i].finger);
    *at++ = 'A';
    *at++ = static_cast<char>('A' + joints[i].place);
    at = write_glove_value(at, ')', joints[i].flexion);
  }
  *at++ = '\n';
  return static_cast<uint8_t>(at - text);
}

// What the glove answers to a Z: the version of these lines, 1 .. 1023 (a left hand's of version 0 is empty to
// the driver), kind of glove 0, hand. `text` has room for kMaxInformationText.
inline uint8_t encode_glove_information(uint16_t version, bool right, char* text) {
  char* at = text;
  for (const char* head = "Z(ZV)"; *head != 0;) *at++ = *head++;
  at = write_glove_number(at, version);
  for (const char* rest = "(ZG)0(ZH)"; *rest != 0;) *at++ = *rest++;
  *at++ = right ? '1' : '0';
  *at++ = '\n';
  return static_cast<uint8_t>(at - text);
}

// What one line carries, as the driver reads it.
struct GloveLine {
  bool has[kGloveFingers];
  GloveValues values;
  bool has_joint[kGloveFingers][kGlovePlaces];
  uint16_t joint[kGloveFingers][kGlovePlaces];
  uint16_t version;  // of an information
  uint16_t hand;     // likewise: 0 left, 1 right
};

enum class GloveParse : uint8_t {
  ok = 0,
  information,  // version and hand, no frame
  no_end,       // no line feed
  no_digits,    // an analog key without a number, or with a sign: the driver rejects the whole line
  too_large,    // a number above 65535
  no_fingers,   // fingers alone, without a joystick: taken for empty; or nothing known at all
};

namespace glove_text {

inline bool is_key(char c) { return (c >= 'A' && c <= 'Z') || c == '(' || c == ')'; }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

// A key with its number: up to five letters, brackets included; a longer one is none that is known.
struct Item {
  char key[6];
  uint8_t length;
  bool digits;
  uint32_t value;  // at most 65536
};

// From text[at], which is a key's letter, to behind the number. The driver goes on through letters and
// brackets behind an opening bracket, whether or not it was closed.
inline Item read_item(const char* text, uint16_t size, uint16_t& at) {
  Item item{};
  const bool is_long = text[at] == '(';
  do {
    if (item.length < 6) item.key[item.length++] = text[at];
    ++at;
  } while (is_long && at < size && is_key(text[at]));
  for (; at < size && is_digit(text[at]); ++at) {
    item.digits = true;
    if (item.value <= UINT16_MAX) item.value = 10 * item.value + static_cast<uint32_t>(text[at] - '0');
  }
  return item;
}

inline bool is_long(const Item& item, char first, char second) {
  return item.length == 4 && item.key[0] == '(' && item.key[1] == first && item.key[2] == second &&
         item.key[3] == ')';
}

// The joint's number that (xAy) names, or null.
inline uint16_t* joint_of(const Item& item, GloveLine& line) {
  const bool is_joint = item.length == 5 && item.key[0] == '(' && item.key[1] >= 'A' && item.key[1] <= 'E' &&
                        item.key[2] == 'A' && item.key[3] >= 'A' && item.key[3] <= 'D' && item.key[4] == ')';
  if (!is_joint) return nullptr;
  line.has_joint[item.key[1] - 'A'][item.key[3] - 'A'] = true;
  return &line.joint[item.key[1] - 'A'][item.key[3] - 'A'];
}

// Where an analog key's number goes, or null for a key that has none.
inline uint16_t* place_of(const Item& item, GloveLine& line, uint16_t& splay) {
  const char key = item.key[0];
  if (item.length == 1 && key >= 'A' && key <= 'E') {
    line.has[key - 'A'] = true;
    return &line.values.flexion[key - 'A'];
  }
  if (item.length == 1 && (key == 'F' || key == 'G')) return &line.values.joystick[key - 'F'];
  if (item.length == 1 && key == 'P') return &line.values.trigger;
  if (item.length == 4 && item.key[1] >= 'A' && item.key[1] <= 'E' && is_long(item, item.key[1], 'B'))
    return &splay;
  if (is_long(item, 'Z', 'V')) return &line.version;
  if (is_long(item, 'Z', 'H')) return &line.hand;
  return joint_of(item, line);
}

}  // namespace glove_text

// Splay, spaces, carriage returns and unknown keys are passed over. The last of equal keys counts.
inline GloveParse parse_gloves(const char* text, uint16_t size, GloveLine& line) {
  line = GloveLine{};
  bool information = false;
  bool joystick = false;
  uint16_t at = 0;
  while (at < size && text[at] != '\n') {
    if (!glove_text::is_key(text[at])) {
      ++at;
      continue;
    }
    const glove_text::Item item = glove_text::read_item(text, size, at);
    const char key = item.length == 1 ? item.key[0] : ' ';
    information = information || key == 'Z';
    joystick = joystick || key == 'F' || key == 'G';
    if (key >= 'H' && key <= 'O')
      line.values.buttons = static_cast<uint8_t>(line.values.buttons | 1 << (key - 'H'));
    uint16_t splay = 0;
    uint16_t* value = glove_text::place_of(item, line, splay);
    if (value == nullptr) continue;
    if (!item.digits) return GloveParse::no_digits;
    if (item.value > UINT16_MAX) return GloveParse::too_large;
    *value = static_cast<uint16_t>(item.value);
  }
  if (at == size) return GloveParse::no_end;
  if (information) return GloveParse::information;
  bool any = false;
  for (uint8_t i = 0; i < kGloveFingers; ++i) any = any || line.has[i];
  return any && joystick ? GloveParse::ok : GloveParse::no_fingers;
}

}  // namespace link
}  // namespace flexor
