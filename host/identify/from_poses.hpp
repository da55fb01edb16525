// A compensator from two held poses, for somebody without a camera: a straight line from the open hand to the fist.
//
//   angle = (reading - open) / (fist - open) angle of the fist
// The log begins with the open hand held; every rest of a second in which all sensors lie where they lay then is the open hand,
// every one in which they lie at the other end is the fist. Nothing is measured: the angle of a fist is that of an ordinary hand
// (90 degrees, the thumb's 60), and so is the error that the model states.
#pragma once

#include <string>
#include <vector>

#include "host/model/model.hpp"
#include "host/recording/recording.hpp"

namespace flexor::identify {

inline constexpr double kFist_deg = 90;
inline constexpr double kThumbFist_deg = 60;
inline constexpr double kPosesError_deg = 20;  // expected: an ordinary hand's fist is not everybody's

struct FromPoses {
  model::Model model;
  int open_holds = 0;
  int fist_holds = 0;
  std::vector<std::string> warnings;  // sensors that were left out
};

// `log` has a column for each sensor; one that is called host_s is none. Throws io::JobError, one line with the mend: no rest, no
// two poses, no sensor that tells them apart.
FromPoses model_from_poses(const recording::Recording& log, double rate_hz);

}  // namespace flexor::identify
