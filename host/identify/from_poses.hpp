// A compensator from two held poses, for somebody without a camera: a straight line from the open hand to the fist.
//
//   angle = open_deg + (reading - open) / (fist - open) (fist_deg - open_deg)
// The log begins with the open hand held; every rest of a second in which all sensors lie where they lay then is the open hand,
// every one in which they lie at the other end is the fist. Nothing is measured: unless others are told, the angles are
// those of an ordinary hand (0 open, a fist 90, the thumb's 60), and so is the error that the model states.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host/model/model.hpp"
#include "host/recording/recording.hpp"

namespace flexor::identify {

inline constexpr model::Ends kFinger = {0, 90};
inline constexpr model::Ends kThumb = {0, 60};
inline constexpr double kPosesError_deg = 20;  // expected: an ordinary hand's fist is not everybody's

struct FromPoses {
  model::Model model;
  int open_holds = 0;
  int fist_holds = 0;
  std::vector<std::string> warnings;  // sensors that were left out
};

// `log` has a column for each sensor; one that is called host_s is none. Throws io::JobError, one line with the mend: no rest, no
// two poses, no sensor that tells them apart; and io::InputError: `angles`, by joint, of a joint that has no sensor, or both the
// same.
FromPoses model_from_poses(const recording::Recording& log, double rate_hz,
                           const std::map<std::string, model::Ends>& angles = {});

}  // namespace flexor::identify
