// Where sensors lie and how far they reach since a glove was put on again: the most probable line of each, from held poses,
// stretches of motion and a camera together.
//
//   made = middle + e^g (reading - middle) + s span
// `made` is what the sensor read where the model was made, `middle` and `span` are those of its readings there. A glove moves
// as a whole: s = c + a, of which c ~ N(0, alike shift_sd^2) is one for all sensors and a is each one's own, of variance
// (1 - alike) shift_sd^2 with the tails of Student's t; g ~ N(0, log_gain_sd^2). Each piece of evidence adds residuals of unit
// variance in (s, g, ...); the maximum a posteriori is their least-squares solution (levenberg_marquardt.hpp).
// Source: S. Kay, Fundamentals of Statistical Signal Processing (1993), 11.5 (MAP of linear models); the tails: K. Lange and
// others, Robust statistical modeling using the t distribution, JASA 84 (1989).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/readings.hpp"
#include "host/identify/recalibrate.hpp"

namespace flexor::identify {

// Of one sensor, in spans and as a logarithm.
struct Line {
  double shift = 0;
  double log_gain = 0;
};

model::Correction correction_of(const Line& line, const model::Spread& made);

// Of a sensor's shift among the unknowns; that of its gain is the next.
inline Eigen::Index column(std::size_t sensor) { return 2 * static_cast<Eigen::Index>(sensor); }

// Of one sensor.
struct FittedLine {
  Line line;
  bool gain_is_determined = false;  // the evidence narrows the gain; else it stays as it is
  double shift_variance = 0;
  double log_gain_variance = 0;
  double covariance = 0;
};

inline constexpr double kUnmoved = 0.15;  // of what the poses were apart

// What one sensor reads in either pose; NaN: nothing that counts.
struct PosesHeld {
  double open = std::numeric_limits<double>::quiet_NaN();
  double fist = open;
  double share = open;  // of what the poses were apart where the model was made

  bool both() const { return !std::isnan(share); }
  bool moved() const { return std::abs(share) > kUnmoved; }
};

// What a stretch of motion shows of one sensor.
struct Window : model::Spread {
  Turns turns;
  Eigen::MatrixXd whitening = {};  // of its errors: lower triangle of their covariance's Cholesky factor
};

// What is known of one sensor.
struct Case : RecalibratedSensor {
  Prior prior;
  model::Spread made;
  Reach reach;
  double turn = 0;
  std::vector<std::optional<Window>> windows;  // of each log, where it tells
  std::optional<Window> shown;                 // of the log that shows most
  std::optional<model::Poses> poses;           // where the model was made
  PosesHeld held;
  bool informed = false;
  bool by_poses = false;  // alone
  std::string misfit;
  std::string wanted;
  FittedLine fit;
  std::optional<Line> other;  // other_line
};

// The most probable line of each sensor into its case; the covariance of all that is unknown, the sensors' shifts and logarithms of the gain
// first. The inputs of `model` say what they read. Evidence:
// Held poses. A hand errs as a whole as well: all of its fingers may be less open, or less closed, than they were. A fist that is
// not as tight is common, one that is tighter is not: how far a pose lies towards the open hand is broad, beyond the pose narrow.
// Of each log, the quantiles of its sensors' motion against those of the motion that the model was made from. Each end is known
// as well as the turns there repeat; another motion lies elsewhere by motion_sd, of whose variance a part is one for all sensors
// (the hand does the same with all of its fingers), and reaches farther by reach_sd; what lies between the ends has density_sd of
// its own besides. What the stretch lacks of the span, or goes beyond it, may be at either end: half of it is how far
// the middle may lie off (less where every turn is at one of two ends), and what is more than a gain makes likely counts as reach.
// A camera, or null. Each sample's error is that of the model where it was proven, of which only one a
// second counts as new; each joint's marks sit otherwise by 3 degrees (an unknown of its own); large errors count by their size
// (pseudo-Huber).
Eigen::MatrixXd estimate(const model::Model& model, const Seen* seen, std::vector<Case>& cases);

// Of a joint that a camera saw.
struct SeenFit {
  double alike = 0;         // correlation of its angles with the model's as it was
  double rmse_deg = 0;      // of the lines' angles against the camera's
  double expected_deg = 0;  // the same by the model's own error and how marks sit
};
std::vector<SeenFit> fits_of(const model::Model& model, const Seen& seen, const std::vector<Case>& cases);

}  // namespace flexor::identify
