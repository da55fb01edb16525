// What a glove's firmware will instantiate.
#include "runtime/sensor/calibration.hpp"
#include "runtime/sensor/guard.hpp"
#include "runtime/sensor/monitor.hpp"

flexor::sensor::Calibration calibration[5];
flexor::sensor::MonitorSettings monitor_settings;
flexor::sensor::GuardSettings guard_settings;
flexor::sensor::Monitor monitors[5];
volatile uint16_t adc[5];
volatile int16_t angle[5];

int main() {
  flexor::sensor::Guard guard;
  guard.reset(guard_settings);
  for (;;) {
    for (int i = 0; i < 5; ++i) {
      const uint16_t counts = adc[i];
      const bool alive = monitors[i].step(monitor_settings, counts) == flexor::sensor::Health::ok;
      angle[i] = guard.step(guard_settings, alive, calibration[i](counts));
    }
  }
}
