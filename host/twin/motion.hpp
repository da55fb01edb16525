// What a person's hand does: one angle for each finger at each time.
//
// A gesture is data: poses, and moves that start at a time and take some fingers to a pose at a finger speed.
// A move is a ramp of duration R = |to - from| / speed, its corners rounded by a moving average of width w =
// corner_s, so that it ends after R + w. A recorded motion is a recording's columns, straight lines between
// samples.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/twin/parameters.hpp"

namespace flexor::twin {

inline constexpr double kMaxDuration_s = 3600;

// How one trial differs from the plan; zeros and speed 1: not at all.
struct Variation {
  double delay_s = 0;
  double speed = 1;
  double pose_share = 1;         // of the way from the finger's lower limit
  PerFinger lower_offset_deg{};  // at the finger's lower limit; between the limits in proportion
  PerFinger upper_offset_deg{};
};

class Motion {
 public:
  // Angles lie between 0 and 180 degrees, speeds between 0.1 and 10000 deg/s, moves inside a duration of at
  // most kMaxDuration_s. Throws io::InputError naming file and place.
  static Motion from_json(const std::string& text, const std::string& source);

  // Samples at t_s (strictly increasing, from 0), angle_deg[finger][sample]. The first and last angle hold
  // outside.
  static Motion from_samples(std::string name, std::vector<double> t_s,
                             std::array<std::vector<double>, kFingers> angle_deg);

  // Degrees; t_s may be negative.
  double angle(int finger, double t_s, const Variation& variation) const;

  const std::string& name() const { return name_; }
  const std::string& description() const { return description_; }
  int number() const { return number_; }  // of the published gestures; 0: none of them
  double duration_s() const { return duration_s_; }
  const std::string& document() const { return document_; }  // it was read from; of samples there is none
  const std::vector<double>& t_s() const { return t_s_; }    // of samples
  const std::array<std::vector<double>, kFingers>& sample_deg() const { return sample_deg_; }

 private:
  struct Move {
    double start_s = 0;
    double ramp_s = 0;
    double from_deg = 0;
    double to_deg = 0;
  };

  struct Reader;
  double planned(int finger, double t_s, const Variation& variation) const;

  std::string document_;
  std::string name_;
  std::string description_;
  int number_ = 0;
  double duration_s_ = 0;
  double corner_s_ = 0;
  double anchor_s_ = 0;  // first move's start, 0 with none: a quicker person starts then, too
  PerFinger start_deg_{};
  std::array<std::vector<Move>, kFingers> moves_;
  std::vector<double> t_s_;
  std::array<std::vector<double>, kFingers> sample_deg_;
};

}  // namespace flexor::twin
