// A compensator from two held poses, for somebody without a camera: a straight line from the open hand to the fist.
//
//   angle = open_deg + (reading - open) / (fist - open) (fist_deg - open_deg)
// The two rests of a second that lie farthest apart are the poses, with every rest that lies by one of them; what lies between, as a
// hand at ease at the beginning, is none. The first is the open hand, unless all readings fall from it to the other. Nothing is measured: unless others are given, the angles are those of an ordinary hand (0 open, a fist 90,
// the thumb's 60), and so is the error that the model states.
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

enum class FirstPose { unstated, open, fist };

struct PosesOptions {
  double rate_hz = 20;
  std::map<std::string, model::Ends> angles = {};  // by joint
  std::vector<std::string> joints = {};  // of the log's sensors, in their order; empty: named as the columns
  FirstPose first = FirstPose::unstated;
};

struct FromPoses {
  model::Model model;
  int open_holds = 0;
  int fist_holds = 0;
  std::vector<std::string> warnings;  // sensors that were left out
};

// `log` has a column for each sensor; one that is called host_s is none. Throws io::JobError, one line with the mend: no sensor that moves, no rest, no
// two poses, fewer than half of the sensors distinguish them; and io::InputError: `angles` of a joint that has no sensor, or both
// the same; names of joints that are not as many as the sensors.
FromPoses model_from_poses(const recording::Recording& log, const PosesOptions& options);

}  // namespace flexor::identify
