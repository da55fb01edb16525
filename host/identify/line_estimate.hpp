// Where sensors lie and how far they reach since a glove was put on anew: the most probable line of each, from whatever
// evidence there is.
//
//   made = middle + e^g (reading - middle) + s span
// `made` is what the sensor read where the model was made, `middle` and `span` are those of its readings there. A glove moves
// as a whole: s = c + a, of which c ~ N(0, alike shift_sd^2) is one for all sensors and a is each one's own, of variance
// (1 - alike) shift_sd^2 with the tails of Student's t; g ~ N(0, log_gain_sd^2). Each piece of evidence adds rows of the form
// error = J (s, g, ...) + N(0, 1), and the maximum a posteriori is their least-squares solution, by QR of the stacked rows,
// again and again where they bend.
// Source: S. Kay, Fundamentals of Statistical Signal Processing (1993), 11.5 (MAP of linear models); the tails: K. Lange and
// others, Robust statistical modeling using the t distribution, JASA 84 (1989).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "host/identify/donning_prior.hpp"
#include "host/model/correction.hpp"
#include "host/model/model.hpp"

namespace flexor::identify {

// Of one sensor, in spans and as a logarithm.
struct Line {
  double shift = 0;
  double log_gain = 0;
};

model::Correction correction_of(const Line& line, const model::Spread& made);

// Of a sensor's shift among the unknowns; that of its gain is the next.
inline Eigen::Index column(std::size_t sensor) { return 2 * static_cast<Eigen::Index>(sensor); }

// Each with a standard deviation of one; two columns for each sensor, then those of what else is unknown.
struct Rows {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd error;  // at the lines that were asked about
};

struct Evidence {
  Eigen::Index unknowns = 0;  // of its own, of unit variance
  std::function<Rows(const std::vector<Line>& lines, const Eigen::VectorXd& own)> rows;
};

// Of one sensor.
struct FittedLine {
  Line line;
  bool gain_told = false;  // the evidence narrows the gain; else it stays as it is
  double shift_variance = 0;
  double log_gain_variance = 0;
  double covariance = 0;
};

struct LineEstimate {
  std::vector<FittedLine> fit;
  Eigen::MatrixXd covariance;  // of all that is unknown, the sensors' shifts and logarithms of the gain first
};

LineEstimate estimate(const std::vector<Prior>& priors, const std::vector<Evidence>& evidence);

}  // namespace flexor::identify
