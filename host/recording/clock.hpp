// The clock of two files from what several of their signals say of it.
//
// Of each angle the surest sensor counts, and of each sensor all of its angles together. Signals that are more than half a
// second apart do not mean one clock: those that agree with the surest count, each with the weight confidence / error^2.
// Confidence of all: that of the surest.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/recording/align.hpp"

namespace flexor::recording {

// A sensor and an angle that bends it.
struct Witness {
  std::size_t sensor = 0;  // witnesses of one sensor have one number
  Series reading;
  Recording* reference = nullptr;
  std::string column;  // of the reference
  std::string name;    // for messages
};

struct Clock {
  double offset_s = 0;  // reference time minus sensor time, once the drift is out
  double standard_error_s = 0;
  double confidence = 0;  // 0 to 1, as Alignment
  double drift_ppm = 0;   // of the reference's clock, taken out of its times; 0: none that is clear
  double drift_se_ppm = 0;
  std::optional<Alignment> surest = {};  // of the signals, once the drift is out; none: the offset was given
};

// A drift that is clear (three standard errors) is taken out of the references' times, unless the clock `is_common` to both files.
// `given`: the user's offset, or that of a common clock; it is compared with the signals, and those that agree with it tell the drift.
// Throws io::JobError where no signal tells.
Clock find_clock(const std::vector<Witness>& witnesses, std::optional<double> given, bool is_common,
                 std::vector<std::string>& warnings);

}  // namespace flexor::recording
