// The tracker alone on a board: a marker before and after each sample, a CRC of all that it says.
#include <avr/io.h>

#include "cosim/tracker_exercise.hpp"
#include "firmware/markers.hpp"
#include "runtime/core/crc16.hpp"
#include "runtime/sensor/tracker.hpp"

using Tracking = flexor::sensor::FixedTracking;

volatile uint16_t said __attribute__((used));

// As a configuration has them: constants, which the compiler cannot fold with readings.
const flexor::sensor::TrackerSettings<Tracking> kSettings = {9472, 1669, 1100};
const flexor::sensor::TrackedStrip<Tracking> kStrip = {2288, 1328, 42, 6, 1579};

flexor::sensor::Tracker<Tracking> tracker;

__attribute__((noinline)) int16_t sample(int16_t reading) {
  tracker.observe(kSettings, kStrip, reading);
  return tracker.corrected(kStrip, reading);
}

int main() {
  flexor::cosim::TrackerExercise exercise;
  tracker.reset(kSettings);
  uint16_t crc = 0;
  for (uint16_t k = 0; k < exercise.kSamples; ++k) {
    const int16_t reading = exercise.next();
    GPIOR0 = static_cast<uint8_t>(flexor::firmware::Marker::step_begin);
    const int16_t corrected = sample(reading);
    GPIOR0 = static_cast<uint8_t>(flexor::firmware::Marker::step_end);
    crc = flexor::core::crc16_add(crc, static_cast<uint8_t>(corrected));
    crc = flexor::core::crc16_add(crc, static_cast<uint8_t>(corrected >> 8));
  }
  said = crc;
  for (;;) {
  }
}
