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
#include <vector>

#include "host/donning/prior.hpp"
#include "host/donning/window.hpp"
#include "host/model/correction.hpp"
#include "host/model/model.hpp"

namespace flexor::donning {

// Of one sensor, in spans and as a logarithm.
struct Line {
  double shift = 0;
  double log_gain = 0;
};

model::Correction correction_of(const Line& line, const model::Spread& made);

// Rows of evidence, each with a standard deviation of one; two columns for each sensor, then those of what else is unknown.
struct Rows {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd error;  // at the lines that were asked about
};

// A reading of one sensor now, and what it would have been where the model was made; standard error in spans.
struct Sighting {
  std::size_t sensor = 0;
  double reading = 0;
  double made = 0;
  double error = 0;
  double pose = 0;  // from the open hand to the fist where the model was made, in spans
  bool fist = false;
};

class Evidence {
 public:
  virtual ~Evidence() = default;
  // Unknowns of its own, of unit variance.
  virtual Eigen::Index unknowns() const { return 0; }
  virtual Rows rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const = 0;
};

// Held poses. A hand errs as a whole as well: all of its fingers may be less open, or less closed, than they were. A fist that is
// not as tight is common, one that is tighter is not: how far a pose lies towards the open hand is broad, beyond the pose narrow.
class Sightings : public Evidence {
 public:
  Sightings(std::vector<Sighting> sightings, const std::vector<model::Spread>& made)
      : sightings_(std::move(sightings)), made_(made) {}
  Eigen::Index unknowns() const override { return 2; }  // of the open hand and of the fist
  Rows rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const override;

 private:
  std::vector<Sighting> sightings_;
  std::vector<model::Spread> made_;
};

// What a stretch of motion shows of one sensor.
struct Stretch {
  std::size_t sensor = 0;
  Window window;
  model::Spread made;
  Prior prior;
  int bends = 0;  // 1: readings rise as the finger bends, -1: they fall, 0: not known
};

// The quantiles of a stretch of motion, against those of the motion that the model was made from. Each end is known as well
// as the turns there repeat; another motion lies elsewhere by motion_sd, of whose variance a part is one for all sensors (the
// hand does the same with all of its fingers), and reaches farther by reach_sd; what lies between the ends has density_sd of
// its own besides. What the stretch lacks of the span, or goes beyond it, may be at either end: half of it is how far
// the middle may lie off (less where every turn is at one of two ends), and what is more than a gain makes likely counts as reach.
class Quantiles : public Evidence {
 public:
  explicit Quantiles(std::vector<Stretch> stretches);
  Eigen::Index unknowns() const override { return 1; }  // where this motion lies, for all sensors
  Rows rows(const std::vector<Line>& lines, const Eigen::VectorXd& own) const override;

 private:
  std::vector<Stretch> stretches_;
  std::vector<Eigen::MatrixXd> whitening_;  // lower triangles of the covariances' Cholesky factors
};

struct Estimate {
  std::vector<Line> line;
  Eigen::MatrixXd
      covariance;  // of shift and logarithm of the gain, sensor after sensor; of all that is unknown
  std::vector<std::uint8_t> gain_told;  // the evidence narrows the gain; else it stays as it is
};

Estimate estimate(const std::vector<Prior>& priors, const std::vector<const Evidence*>& evidence);

}  // namespace flexor::donning
