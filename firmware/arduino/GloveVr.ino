// A glove for VR drivers that read OpenGloves' lines, at the board's USB port.
#include <glove_data.h>

const uint8_t kPins[FlexorGlove::kFingers] = {A0, A1, A2, A3, A4};  // thumb to pinky

// Each button's pin, closed to ground when pressed, and its bit of flexor::link::glove_button.
const uint8_t kNone = 255;
const uint8_t kButtons[][2] = {{kNone, 0}};
const uint8_t kJoystick[] = {kNone, kNone};  // x, y

FlexorGlove glove(kFlexorSettings, kFlexorKey, kFlexorModel, sizeof(kFlexorModel));
uint32_t next_ms = 0;

void setup() {
  Serial.begin(115200);
  for (const auto& button : kButtons) {
    if (button[0] != kNone) pinMode(button[0], INPUT_PULLUP);
  }
  next_ms = millis();
}

uint8_t pressed() {
  uint8_t bits = 0;
  for (const auto& button : kButtons) {
    if (button[0] != kNone && digitalRead(button[0]) == LOW) bits |= button[1];
  }
  return bits;
}

uint16_t joystick(uint8_t axis) {
  constexpr uint16_t kMiddle = 512;
  return kJoystick[axis] == kNone ? kMiddle : static_cast<uint16_t>(analogRead(kJoystick[axis]));
}

void loop() {
  glove.listen(Serial);
  if (static_cast<int32_t>(millis() - next_ms) < 0) return;
  next_ms += glove.period_ms();
  uint16_t counts[FlexorGlove::kFingers];
  // Boards whose analogRead has 12 bits: analogReadResolution(10) in setup().
  for (uint8_t i = 0; i < FlexorGlove::kFingers; ++i) counts[i] = static_cast<uint16_t>(analogRead(kPins[i]));
  glove.step(counts);
  glove.send(Serial, pressed(), joystick(0), joystick(1));
}
