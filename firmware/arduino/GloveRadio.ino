// A glove whose radio is at the board's only serial port, as on an Uno or a Nano: nothing but frames go there.
#include <glove_data.h>

const uint8_t kPins[FlexorGlove::kFingers] = {A0, A1, A2, A3, A4};  // thumb to pinky

FlexorGlove glove(kFlexorSettings, kFlexorKey, kFlexorModel, sizeof(kFlexorModel));
uint32_t next_ms = 0;

void setup() {
  Serial.begin(9600);  // the radio's rate
  next_ms = millis();
}

void loop() {
  glove.listen(Serial);
  if (static_cast<int32_t>(millis() - next_ms) < 0) return;
  next_ms += glove.period_ms();
  uint16_t counts[FlexorGlove::kFingers];
  for (uint8_t i = 0; i < FlexorGlove::kFingers; ++i) counts[i] = static_cast<uint16_t>(analogRead(kPins[i]));
  glove.step(counts);
  glove.send(Serial);
}
