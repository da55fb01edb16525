// What a glove's firmware will instantiate.
#include "runtime/sensor/calibration.hpp"
#include "runtime/sensor/guard.hpp"
#include "runtime/sensor/monitor.hpp"
#include "runtime/sensor/tracker.hpp"

flexor::sensor::Calibration calibration[5];
flexor::sensor::MonitorSettings monitor_settings;
flexor::sensor::GuardSettings guard_settings;
flexor::sensor::Monitor monitors[5];
using Tracking = flexor::sensor::FixedTracking;
flexor::sensor::TrackerSettings<Tracking> tracker_settings;
flexor::sensor::TrackedStrip<Tracking> strips[5];
flexor::sensor::Tracker<Tracking> trackers[5];
static_assert(sizeof(trackers[0]) <= 24, "bytes a finger");
volatile uint16_t adc[5];
volatile int16_t angle[5];

int main() {
  flexor::sensor::Guard guard;
  guard.reset(guard_settings);
  for (;;) {
    for (int i = 0; i < 5; ++i) {
      const uint16_t counts = adc[i];
      const bool alive = monitors[i].step(monitor_settings, counts) == flexor::sensor::Health::ok;
      const int16_t alpha = calibration[i](counts);
      if (alive) trackers[i].observe(tracker_settings, strips[i], alpha);
      angle[i] = guard.step(guard_settings, alive, trackers[i].corrected(strips[i], alpha));
    }
  }
}
