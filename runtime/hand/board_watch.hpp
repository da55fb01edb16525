// What all fingers hang on: the converter that reads their potentiometers, and the supply.
//
// The converter measures its own bandgap against the supply: counts = 1023 V_bandgap / V_supply. The bandgap is
// anything from 1.0 to 1.2 V, but the same for life: the supply has dipped when the counts exceed those of the
// start by a ninth (5 V: below 4.44 V), or kLowest.
#pragma once

#include <stdint.h>

#include "runtime/hand/fault.hpp"

namespace flexor {
namespace hand {

constexpr uint16_t kBandgapLow = 150;   // of a converter or a reference that is broken: a supply of 7.5 V,
constexpr uint16_t kBandgapHigh = 500;  // of 2.3 V
constexpr uint16_t kLowest = 330;       // counts, a supply of 3.1 to 3.7 V
constexpr uint8_t kWell_ticks = 200;    // without a fault until it is forgotten

class BoardWatch {
 public:
  // One a tick. `scanned`: the conversions of this tick ended in time; `bandgap` in counts, 0: not yet measured.
  // Returns kSupplyDip, kAdcStuck, both or none.
  uint8_t tick(bool scanned, uint16_t bandgap) {
    if (first_ == 0) first_ = bandgap;
    uint8_t now = scanned ? 0 : kAdcStuck;
    if (bandgap != 0 && (bandgap < kBandgapLow || bandgap > kBandgapHigh)) now |= kAdcStuck;
    if (bandgap > first_ + first_ / 8 || bandgap > kLowest) now |= kSupplyDip;
    if (now != 0) well_ticks_ = 0;
    if (now == 0 && well_ticks_ < kWell_ticks) ++well_ticks_;
    faults_ = static_cast<uint8_t>(well_ticks_ == kWell_ticks ? 0 : faults_ | now);
    return faults_;
  }

 private:
  uint16_t first_ = 0;
  uint8_t well_ticks_ = 0;
  uint8_t faults_ = 0;
};

}  // namespace hand
}  // namespace flexor
