// The tracker of a worn glove on a simulated ATmega328P: the same bits as on a PC, in so many cycles.
#include <gtest/gtest.h>

#include "cosim/board.hpp"
#include "cosim/compiled.hpp"
#include "cosim/tracker_exercise.hpp"
#include "firmware/markers.hpp"
#include "runtime/core/crc16.hpp"
#include "runtime/sensor/tracker.hpp"

namespace flexor::cosim {
namespace {

using Tracking = sensor::FixedTracking;

std::uint16_t said_by_host() {
  constexpr sensor::TrackerSettings<Tracking> kSettings = {9472, 1669, 1100};
  constexpr sensor::TrackedStrip<Tracking> kStrip = {2288, 1328, 42, 6, 1579};
  sensor::Tracker<Tracking> tracker;
  tracker.reset(kSettings);
  TrackerExercise exercise;
  std::uint16_t crc = 0;
  bool moved = false;
  for (int k = 0; k < TrackerExercise::kSamples; ++k) {
    const std::int16_t reading = exercise.next();
    tracker.observe(kSettings, kStrip, reading);
    const std::int16_t corrected = tracker.corrected(kStrip, reading);
    moved = moved || (tracker.shift() != 0 && tracker.stretch() != 0);
    crc = core::crc16_add(crc, static_cast<std::uint8_t>(corrected));
    crc = core::crc16_add(crc, static_cast<std::uint8_t>(corrected >> 8));
  }
  EXPECT_TRUE(moved) << "the exercise shows the tracker nothing";
  return crc;
}

TEST(TrackerOnTheBoard, SaysTheSameBitsInAtMostFourHundredCyclesASample) {
  const Firmware firmware =
      compiled({"avr-g++", "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-std=c++14", "-fshort-enums",
                "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-ffunction-sections", "-mrelax",
                "-flto", "-flto-partition=none", "-fwhole-program", "-DFLEXOR_AVR_ASSEMBLY", "-I.",
                "cosim/tracker_board.cpp"})
          .firmware();
  Board board(firmware);
  Cycles begin = 0;
  Cycles sum = 0;
  Cycles worst = 0;
  int samples = 0;
  board.on_marker = [&](Cycles now, std::uint8_t value) {
    if (static_cast<firmware::Marker>(value) == firmware::Marker::step_begin) begin = now;
    if (static_cast<firmware::Marker>(value) != firmware::Marker::step_end) return;
    const Cycles took = now - begin - 2;
    sum += took;
    worst = std::max(worst, took);
    ++samples;
  };
  while (samples < TrackerExercise::kSamples && board.now() < 2000 * kCyclesPerMs)
    board.run_until(board.now() + kCyclesPerMs);
  board.run_until(board.now() + kCyclesPerMs);
  EXPECT_EQ(board.peek<std::uint16_t>(firmware.address("said")), said_by_host());
  ASSERT_EQ(samples, TrackerExercise::kSamples);
  const double mean = static_cast<double>(sum) / samples;
  RecordProperty("mean_cycles", std::to_string(mean));
  RecordProperty("worst_cycles", std::to_string(worst));
  EXPECT_LE(mean, 400);
  EXPECT_LE(worst, 400U);
}

}  // namespace
}  // namespace flexor::cosim
