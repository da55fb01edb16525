// Is the sensor alive? One call a sample.
//
// - open, `rail_samples` readings in a row at or above `high`: the sensor or a wire is off, of infinite resistance
// - short_circuit, as many at or below `low`
// - stuck, the very same reading for `stuck_samples`
//
// A hand that is held still reads the same for a while: up to a second in three hours of recordings of a real glove with flex
// sensors, so two are asked; a quiet potentiometer for longer, so that `stuck` alone is no reason to move a finger.
// A sensor is alive again with the first good reading, which for `stuck` is another one.
#pragma once

#include <stdint.h>

namespace flexor {
namespace sensor {

enum class Health : uint8_t { ok = 0, open = 1, short_circuit = 2, stuck = 3 };

struct MonitorSettings {
  uint16_t low;  // counts
  uint16_t high;
  uint8_t rail_samples;   // at least 1; a tenth of a second forgives a scratch
  uint8_t stuck_samples;  // at least 2; two seconds
};

class Monitor {
 public:
  Health step(const MonitorSettings& c, uint16_t counts) {
    same_ = counts == last_ ? saturating_next(same_) : static_cast<uint8_t>(1);
    last_ = counts;
    const bool at_high = counts >= c.high;
    const bool at_low = counts <= c.low;
    high_ = at_high ? saturating_next(high_) : static_cast<uint8_t>(0);
    low_ = at_low ? saturating_next(low_) : static_cast<uint8_t>(0);
    if (high_ >= c.rail_samples) return health_ = Health::open;
    if (low_ >= c.rail_samples) return health_ = Health::short_circuit;
    // On a rail, but not for long enough: as it was.
    if (at_high || at_low) return health_;
    return health_ = same_ >= c.stuck_samples ? Health::stuck : Health::ok;
  }

 private:
  static uint8_t saturating_next(uint8_t n) { return n == 255 ? n : static_cast<uint8_t>(n + 1); }

  uint16_t last_ = UINT16_MAX;  // no reading
  uint8_t same_ = 0;
  uint8_t high_ = 0;
  uint8_t low_ = 0;
  Health health_ = Health::ok;
};

}  // namespace sensor
}  // namespace flexor
