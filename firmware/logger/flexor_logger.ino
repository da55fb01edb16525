// Logs the glove's strips for `flexor identify`: a line for each sample, with the board's own time.
//
//   t_s,thumb_count,index_count,middle_count,ring_count,pinky_count
//   0.0000,512,498,505,530,520
// For any board that the Arduino IDE knows. Open the port at 115200 baud and save what comes:
//   stty -F /dev/ttyUSB0 115200 raw && cat /dev/ttyUSB0 > glove.csv
#include <Arduino.h>

struct Column {
  const char* name;  // the unit stands behind the last _
  uint8_t pin;
};

const Column kColumns[] = {
    {"thumb_count", A0},   //
    {"index_count", A1},   //
    {"middle_count", A2},  //
    {"ring_count", A3},    //
    {"pinky_count", A4},   //
};

const uint32_t kPeriod_us = 10000;  // 100 Hz
const uint32_t kSecond_us = 1000000;

bool logging = false;
uint32_t last_us = 0;
uint32_t next_us = 0;
uint32_t elapsed_s = 0;  // since the header, with the part of a second: neither wraps in a lifetime
uint32_t elapsed_us = 0;

void begin_log() {
  Serial.print("t_s");
  for (const Column& column : kColumns) {
    Serial.print(',');
    Serial.print(column.name);
  }
  Serial.print('\n');
  last_us = next_us = micros();
  elapsed_s = elapsed_us = 0;
  logging = true;
}

void print_time() {
  Serial.print(elapsed_s);
  Serial.print('.');
  for (uint32_t power = 100000; power >= 100; power /= 10) Serial.print(elapsed_us / power % 10);
}

void setup() { Serial.begin(115200); }

void loop() {
  if (!Serial) {  // a board with USB of its own, and nobody listens
    logging = false;
    return;
  }
  if (!logging) begin_log();
  const uint32_t now_us = micros();
  if (static_cast<int32_t>(now_us - next_us) < 0) return;
  next_us += kPeriod_us;
  if (static_cast<int32_t>(now_us - next_us) >= 0) next_us = now_us + kPeriod_us;  // late by a whole sample: left out
  elapsed_us += now_us - last_us;
  last_us = now_us;
  for (; elapsed_us >= kSecond_us; elapsed_us -= kSecond_us) ++elapsed_s;
  print_time();
  for (const Column& column : kColumns) {
    Serial.print(',');
    Serial.print(analogRead(column.pin));
  }
  Serial.print('\n');
}
