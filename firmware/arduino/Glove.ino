// A glove: five sensors at analog pins, angles to the serial monitor and, where the board has a second serial port, frames
// to the hand's radio. Any board of the Arduino IDE.
#include <glove_data.h>

const uint8_t kPins[FlexorGlove::kFingers] = {A0, A1, A2, A3, A4};  // thumb to pinky

FlexorGlove glove(kFlexorSettings, kFlexorKey, kFlexorModel, sizeof(kFlexorModel));
uint32_t next_ms = 0;

void setup() {
  Serial.begin(115200);
#if defined(HAVE_HWSERIAL1) || defined(ARDUINO_ARCH_SAMD)
  Serial1.begin(9600);  // the radio's rate
#endif
  next_ms = millis();
}

void loop() {
  if (static_cast<int32_t>(millis() - next_ms) < 0) return;
  next_ms += glove.period_ms();
  uint16_t counts[FlexorGlove::kFingers];
  // Boards whose analogRead has 12 bits: analogReadResolution(10) in setup().
  for (uint8_t i = 0; i < FlexorGlove::kFingers; ++i) counts[i] = static_cast<uint16_t>(analogRead(kPins[i]));
  glove.step(counts);
#if defined(HAVE_HWSERIAL1) || defined(ARDUINO_ARCH_SAMD)
  glove.send(Serial1);
#endif
  for (uint8_t i = 0; i < FlexorGlove::kFingers; ++i) {
    Serial.print(glove.angle_deg(i), 1);
    Serial.print(i + 1 < FlexorGlove::kFingers ? '\t' : '\n');
  }
}
