#include "runtime/hand/board_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexor::hand {
namespace {

uint16_t counts(double bandgap_V, double supply_V) {
  return static_cast<uint16_t>(std::floor(1023 * bandgap_V / supply_V));
}

// Settled at 5 V, then at `supply_V`: the faults.
uint8_t reported(double bandgap_V, double supply_V) {
  BoardWatch watch;
  for (int k = 0; k < 500; ++k) EXPECT_EQ(watch.tick(true, k < 64 ? uint16_t{0} : counts(bandgap_V, 5)), 0);
  return watch.tick(true, counts(bandgap_V, supply_V));
}

TEST(BoardWatch, ADipIsADipWithAnyBandgap) {
  for (const double bandgap_V : {1.0, 1.1, 1.2}) {
    EXPECT_EQ(reported(bandgap_V, 5.2), 0);
    EXPECT_EQ(reported(bandgap_V, 4.6), 0);
    EXPECT_EQ(reported(bandgap_V, 4.3), kSupplyDip);
    EXPECT_EQ(reported(bandgap_V, 3.1), kSupplyDip);
  }
}

TEST(BoardWatch, ASupplyThatIsLowFromTheStartIsNone) {
  BoardWatch watch;
  EXPECT_EQ(watch.tick(true, counts(1.1, 3.2)), kSupplyDip);
}

TEST(BoardWatch, AConverterThatStopsOrLosesItsReferenceIsStuckUntilItHasBeenWellForAWhile) {
  BoardWatch watch;
  EXPECT_EQ(watch.tick(true, 225), 0);
  EXPECT_EQ(watch.tick(false, 225), kAdcStuck);
  for (int k = 1; k < kWell_ticks; ++k) EXPECT_EQ(watch.tick(true, 225), kAdcStuck);
  EXPECT_EQ(watch.tick(true, 225), 0);
  EXPECT_EQ(watch.tick(true, 5), kAdcStuck);
  EXPECT_EQ(watch.tick(true, 1023) & kAdcStuck, kAdcStuck);
}

}  // namespace
}  // namespace flexor::hand
