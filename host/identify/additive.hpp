// Additive compensator of one joint: curves of the readings, of their plays, and of their motion.
//
//   angle[k] = offset + sum_b f_b(x_b[k]),   f_b piecewise linear on the knots of its sensor
//   x_b = u                       the reading: what the sensor says at rest
//   x_b = play of u, radius r     what it says depends on where it came from
//   f_b(u) - H_tau f_b(u)         motion: H_tau a first-order lag; zero wherever the reading rests
//
// For given radii and time constants the angle is linear in the curves' values. The loss counts small errors by their square and
// large ones by their size (pseudo-Huber, one degree wide). A sum goes on beyond what was seen, its curves as straight as at
// their ends, by the range at most. One that is not open has limits: where a finger rests at an end of its range, any estimate
// beyond it is right, and the limit is the median of the angles there. An end beyond which no estimate lies has none. A fold has
// no limit farther than the angles that it was fitted to. Two priors: neighbouring slopes are alike (second differences), and
// what plays and motion add is small (their values). The second also settles what the others leave undetermined. Minimised by
// least squares again and again, from the plain least-squares solution on. Held still, the angle holds still after a second.
// Motion of more than a second (creep) is the exception: it is there for a sensor that creeps while the finger holds still, and
// is taken only where that pays (joint_fit.hpp).
//
// A glove that is put on again reads otherwise. Where a finger rests at an end, the compensator is fitted for readings 3 % of
// their range off (one standard deviation, of each sensor by itself), which is what donnings of a cloth glove differ by: it
// rests then, too.
//
// Of several recordings each is a donning, with an offset and a slope of its own by each sensor, drawn from normal distributions
// about zero, together zero: they take what differs between recordings, and the curves keep what all share.
//
// Radii, time constants, knots and the strength of the priors are chosen by cross-validation: over blocks of the fitted samples,
// or over recordings where there are more than two. Of candidates that are as good within 3 %, in loss and in mean square, the
// smallest is taken: less to run on a board. Curves with limits are tried of the best open ones, and taken where their loss over
// the folds, of the samples as they were, is lower by more than a standard error. The curve of one sensor, of all that is still,
// turns back only where it does so by more than ten standard errors. Standard errors of the curves' values are those of a
// bootstrap over blocks of 20 s, six at least, or whole recordings, so that they hold for errors that come in runs; knots and
// priors stay as they are. Sources: P. Eilers, B. Marx, Statistical Science 11 (1996) 89 (penalised curves); J. Tobin,
// Econometrica 26 (1958) 24 (limits in the loss); B. Silverman, JRSS B 47 (1985) 1; H. Kuensch, Ann. Statist. 17 (1989) 1217
// (bootstrap over blocks).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::identify {

// One recording of one joint on a uniform grid.
struct Session {
  Eigen::MatrixXd input;          // sample by sensor
  Eigen::VectorXd angle_deg;      // measured
  std::vector<std::uint8_t> use;  // 1 where a sample's error counts
};

// Where their errors count, one session behind the other.
std::vector<double> used_readings(std::span<const Session> sessions, Eigen::Index sensor);
std::vector<double> used_angles(std::span<const Session> sessions);

// The shape of an additive compensator; every sensor gets the same branches.
struct Branches {
  std::vector<double> radii;   // of plays, as shares of the sensor's range
  std::vector<double> lags_s;  // of motion
  int knots = 12;
  bool open = false;  // without limits

  std::size_t still() const { return 1 + radii.size(); }
  bool operator==(const Branches&) const = default;
};

std::string describe(const Branches& branches);

inline constexpr double kCreep_s =
    1;  // a longer motion is there to undo a sensor's creep: its angle goes on in a hold
bool creeps(const Branches& branches);

inline constexpr double kAsGood = 0.03;  // a smaller candidate so close to the best is as good

// By how much the losses over the same folds of `one` are less than the other's, in standard errors of the difference; equal ones: 0.
double gain_in_errors(const std::vector<double>& one, const std::vector<double>& other);

struct Candidates {
  std::vector<Branches> branches;
  // Then, of one sensor, curves of 20 knots of the best and of motion alone; and the best curves with limits.
  bool search = false;

  bool operator==(const Candidates&) const = default;
};

// What a name stands for: auto; limited-line (gain and offset), line-lead (and motion), curve, hysteresis: all but the first
// open and with limits.
Candidates candidates(const std::string& name, std::size_t sensors);

struct Priors {
  double smooth = 0.03;   // weight of squared second differences, beside squared errors, both in degrees
  double plays = 3;       // of the squared values of plays
  double motion = 0.001;  // of those of motion
  double donning = 1;     // of the squared offsets and slopes of the recordings
};

// What errors to expect by the estimate, on a part of the motion that no fold saw: root mean squares of cross-validated (estimate,
// its error), degrees, in groups of as many samples each, half of each pooled over all, times 1.35 as real recordings have it.
model::Accuracy accuracy_of(std::vector<std::pair<double, double>> estimates);

struct Parameter {
  std::string name;
  double value = 0;
  double standard_error = 0;  // 0 where refused
  bool refused = false;
  std::optional<double> initial = {};  // of a chain
};

// Of a chain or a sum.
struct Fitted {
  std::vector<Parameter> parameters;
  Eigen::MatrixXd covariance;  // of these; zero where refused
  double fitted_rmse_deg = 0;  // over the used samples
  double effective = 0;        // parameters that the data determine; of a sum: the trace of its hat matrix
  double condition = 0;  // of a chain: of the column-scaled Jacobian; of a sum: of its regularised system
  int iterations = 0;    // of a chain, from its parameters' initial values
  int start = 0;         // of a chain, whose values these are, from 1
};

struct Validated {
  std::vector<double> fold_loss;   // mean of each fold, as it is minimised
  std::vector<double> plain_loss;  // the same of the samples as they were, without those of other donnings
  std::vector<std::pair<double, double>> estimate;  // and its error, degrees, of each sample as it was
  double cross_validated_deg = 0;                   // root mean square
};

// The covariance is that of the values, column after column.
struct Additive : Validated, Fitted {
  Branches branches;
  Priors priors;
  std::vector<std::vector<double>> knots;  // of each sensor
  std::vector<std::vector<double>> radii;  // of its plays, in its unit
  Eigen::MatrixXd value;  // knot by branch: reading and plays of each sensor, then motions of each
  Eigen::VectorXd
      donning;  // of each recording: offset, then by each sensor what half its range adds; degrees
  double offset_deg = 0;
  model::Saturation limits;              // of the angle
  model::Accuracy accuracy;              // of the cross-validated estimates
  int samples = 0;                       // that were fitted
  std::optional<double> hold_drift_deg;  // of a finished one

  // The values, column after column, then `donning`.
  Eigen::VectorXd coefficients() const {
    Eigen::VectorXd out(value.size() + donning.size());
    out << value.reshaped(), donning;
    return out;
  }
  void set_coefficients(const Eigen::VectorXd& all, Eigen::Index values) {
    value = all.head(values).reshaped(branches.knots, values / branches.knots);
    donning = all.tail(all.size() - values);
  }

  // Columns of `value`.
  Eigen::Index still(std::size_t sensor) const {
    return static_cast<Eigen::Index>(sensor * branches.still());
  }
  Eigen::Index moving(std::size_t sensor) const {
    return static_cast<Eigen::Index>(knots.size() * branches.still() + sensor * branches.lags_s.size());
  }
};

// How far an angle drifts while the readings are held, degrees.
using Drift = std::function<double(const Additive&)>;

// Called before each trial; false: no further one is tried, of structures the first always is.
using Step = std::function<bool(std::size_t done, std::size_t of, const std::string& what)>;

// Asked of the best candidate, then of the next best, until it says yes.
using Accept = std::function<bool(const Additive&)>;

// The candidates, best first, with their cross-validated error; those that were asked for are finished:
// drift and condition are known, and what drifts more than kMostDrift_deg (hold.hpp) in a hold has had its motion
// shrunk until it did not, if that was enough. Throws io::JobError naming the joint: too few samples, constant angle.
std::vector<Additive> fit_additive(const std::vector<Session>& sessions, double period_s,
                                   const std::string& joint, const Candidates& candidates, const Drift& drift,
                                   const Accept& accept, const Step& step);

// Adds the blocks of `fit` behind the model's inputs of these names, and the joint.
void add_to(model::Model& model, Additive fit, const std::vector<std::string>& inputs,
            const std::string& joint);

// The smallest of those that are as good as the best, then the others; the loss decides among equals.
void rank(std::vector<Additive>::iterator begin, std::vector<Additive>::iterator end);

}  // namespace flexor::identify
