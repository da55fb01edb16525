// A glove for VR drivers that read OpenGloves' lines, at the board's USB port.
#include <Flexor.h>

const uint8_t kPins[FlexorGlove::kFingers] = {A0, A1, A2, A3, A4};  // thumb to pinky

FlexorGlove glove;
uint32_t next_ms = 0;

void setup() {
  Serial.begin(115200);
  next_ms = millis();
}

void loop() {
  glove.listen(Serial);
  if (static_cast<int32_t>(millis() - next_ms) < 0) return;
  next_ms += FlexorGlove::kPeriod_ms;
  uint16_t counts[FlexorGlove::kFingers];
  // Boards whose analogRead has 12 bits: analogReadResolution(10) in setup().
  for (uint8_t i = 0; i < FlexorGlove::kFingers; ++i) counts[i] = static_cast<uint16_t>(analogRead(kPins[i]));
  glove.step(counts);
  glove.send(Serial);
}
