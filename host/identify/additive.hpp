// Additive compensator of one joint: curves of the readings, of their plays, and of their motion.
//
//   angle[k] = offset + sum_b f_b(x_b[k]),   f_b piecewise linear on the knots of its sensor
//   x_b = u                       the reading: what the sensor says at rest
//   x_b = play of u, radius r     what it says depends on where it came from
//   f_b(u) - H_tau f_b(u)         motion: H_tau a first-order lag; zero wherever the reading rests
//
// For given radii and time constants the angle is linear in the curves' values, so that the fit is a convex
// least-squares problem with two priors in degrees: neighbouring slopes are alike (second differences), and what
// plays and motion add is small (their values). The second also settles what the others leave undetermined.
// Everything that has a memory forgets within seconds: held still, the angle holds still.
//
// Radii, time constants, knots and the strength of both priors are chosen by blocked cross-validation over the
// fitted samples. Outliers are weighed down (Huber weights from the first fit).
// Sources: P. Eilers, B. Marx, Statistical Science 11 (1996) 89 (penalised curves); B. Silverman, JRSS B 47 (1985) 1.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::identify {

// One recording of one joint on a uniform grid.
struct Session {
  Eigen::MatrixXd input;          // sample by sensor
  Eigen::VectorXd angle_deg;      // measured
  std::vector<std::uint8_t> use;  // 1 where a sample's error counts
};

// The shape of an additive compensator; every sensor gets the same branches.
struct Branches {
  std::vector<double> radii;   // of plays, as shares of the sensor's range
  std::vector<double> lags_s;  // of motion
  int knots = 12;
  bool operator==(const Branches&) const = default;
};

std::string describe(const Branches& branches);

struct Priors {
  double smooth = 10;  // weight of squared second differences, in residual variances
  double plays = 10;   // of the squared values of plays
  double motion = 10;  // of those of motion
};

struct Additive {
  Branches branches;
  Priors priors;
  std::vector<std::vector<double>> knots;  // of each sensor
  std::vector<std::vector<double>> radii;  // of its plays, in its unit
  Eigen::MatrixXd value;  // knot by branch; branches sensor after sensor: reading, plays, motions
  double offset_deg = 0;
  double lower_deg = 0;  // limits of the angle
  double upper_deg = 0;
  double cross_validated_deg = 0;
  double hold_drift_deg = 0;
  double fitted_rmse_deg = 0;
  double condition = 0;  // of the regularised system
  double effective = 0;  // parameters that the data determine: the trace of the hat matrix
  int samples = 0;

  int branches_per_sensor() const {
    return 1 + static_cast<int>(branches.radii.size() + branches.lags_s.size());
  }
};

// How far an angle drifts while the readings are held, degrees.
using Drift = std::function<double(const Additive&)>;

// Called before each trial; false stops.
using Step = std::function<bool(std::size_t done, std::size_t of, const std::string& what)>;

// All candidates with their cross-validated error, best first; what drifts more than `most_drift_deg` in a hold has
// had its motion shrunk until it did not, if that was enough. Throws io::JobError naming the joint: too few samples,
// constant angle.
std::vector<Additive> fit_additive(const std::vector<Session>& sessions, double period_s,
                                   const std::string& joint, const Drift& drift, double most_drift_deg,
                                   const Step& step);

// Adds the blocks of `fit` behind the model's inputs of these names, and the joint.
void add_to(model::Model& model, const Additive& fit, const std::vector<std::string>& inputs,
            const std::string& joint);

}  // namespace flexor::identify
