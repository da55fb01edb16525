// The clock offset of two files from what several of their signals say of it.
//
// Signals that are more than half a second apart do not mean one clock: those that agree with the surest count, each with
// the weight confidence / error^2. Confidence of all: 1 - prod (1 - confidence).
#pragma once

#include <vector>

#include "host/recording/align.hpp"

namespace flexor::recording {

constexpr double kSameClock_s = 0.5;

struct ClockOpinion {
  std::size_t of = 0;     // the caller's number of what says it
  double offset_s = 0;    // reference time minus sensor time
  double confidence = 0;  // 0 to 1
  double error_s = 0;     // above 0
  double lag_s = 0;       // of the sensor, in what the velocities said
};

ClockOpinion opinion_of(const Alignment& alignment, std::size_t of);

// Takes out those that do not agree with the surest.
void keep_agreeing(std::vector<ClockOpinion>& opinions);

struct AgreedClock {
  double offset_s = 0;
  double standard_error_s = 0;
  double confidence = 0;
};

// At least one.
AgreedClock agreed_clock(const std::vector<ClockOpinion>& opinions);

}  // namespace flexor::recording
