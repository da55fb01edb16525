// All joints from some inputs: a Gaussian process that knows that people differ.
//
//   y_j = m_j + o_j + s_j (f_j(x) + g_j(x) + e)     f: everybody's, g: the person's own, e: what x does not determine
//   x   = (inputs - mean - sum of o) / deviation
//   cov f(x) f(x') = x'x + exp(-|x - x'|^2 / (2 l^2)),  cov g(x) g(x') = 1 + exp(-|x - x'|^2 / (2 l^2)) for one person
//   l^2 = a fifth of the number of inputs
//   o   = share (rest - mean rest)                   a person's resting pose, which shifts inputs and joints alike
//
// A cell of a codebook that stands for t seconds is an observation with the variance noise T / t, T the mean length of
// the recordings. The kernel is one for all joints, so that all are solved at once; s_j comes from people who were
// left out (scale_deg2()). What is seen of the new person's whole hand is further observations (Seen), each with the
// variance of e in an average cell: a moment of it, as a cell is a kind of moment.
//
// Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), 2.2; for personal effects as a
// second kernel, Goldberg, Williams and Bishop (1998) and the mixed model of Laird and Ware (1982).
#pragma once

#include <Eigen/Cholesky>
#include <cstddef>
#include <vector>

#include "host/posture/posture.hpp"

namespace flexor::posture {

// An error, and how much it counts.
struct Weighted {
  double size;   // at least 0
  double share;  // above 0
};

// One number for how large errors are, when they need not be normal: the se for which
//
//   share of errors within se + share within 1.96 se = 0.683 + 0.95
//
// Normal errors have both. Of others, what one interval covers too much the other covers too little: both miss by as
// many points. A root mean square would be drawn by the few largest errors, and claim too much.
//
// 0 without errors.
double standard_error(std::vector<Weighted> errors);

// What the inputs' set demands.
struct Shape {
  double noise = 0.03;
  double share = 0.3;  // of the resting pose's offset; 0: no resting pose
};

using People = std::vector<const Person*>;

class Regression {
 public:
  // At least one person; any number of inputs, none included.
  Regression(const People& people, const InputMatrix& inputs, const Shape& shape);

  // o of one whose resting pose is this; NaN: not known of that joint.
  Hand offset_deg(const Hand& rest_deg) const;

  // x of inputs in degrees.
  Eigen::VectorXd scaled(const Eigen::VectorXd& inputs_deg, const Hand& offset_deg) const;

  // Correlations of x with the codebooks' cells, everybody's part.
  Eigen::VectorXd with_cells(const Eigen::VectorXd& x) const;
  // Between two moments of the new person.
  double own(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const;

  Hand mean_deg(const Eigen::VectorXd& with_cells, const Hand& offset_deg) const;
  // K^-1 of the cells.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const { return cells_.solve(right); }

  double instant() const { return instant_; }  // variance of e in a moment
  Eigen::Index cells() const { return x_.rows(); }

 private:
  void take_cells(const People& people);
  // Variance of e in a cell that stands for so many seconds.
  double noise_of(double seconds) const { return shape_.noise * mean_seconds_ / seconds; }

  InputMatrix inputs_;
  Shape shape_;
  Hand mean_rest_deg_ = Hand::Zero();
  Hand mean_deg_ = Hand::Zero();
  Eigen::VectorXd input_mean_deg_;
  Eigen::VectorXd input_sd_deg_;
  Eigen::MatrixXd x_;  // cells x inputs
  Eigen::VectorXd seconds_;
  std::vector<int> who_;
  Hands weight_;  // K^-1 (y - m - o)
  Eigen::LLT<Eigen::MatrixXd> cells_;
  double mean_seconds_ = 1;
  double instant_ = 0;
};

// Its estimate of one person, of whose whole hand some moments were seen. The regression must outlive it.
class Seen {
 public:
  // `hands`: NaN where a joint is not shown; one whose inputs are not known is left out.
  Seen(const Regression& regression, const InputMatrix& inputs, const Hand& offset_deg,
       const std::vector<Hand>& hands);

  Hand mean_deg(const Eigen::VectorXd& inputs_deg) const;
  // In units of s_j^2, of joints that were seen and of those that were not.
  Hand variance(const Eigen::VectorXd& inputs_deg, const Hand& seen_scale, const Hand& other_scale) const;

 private:
  Eigen::VectorXd correlation(const Eigen::VectorXd& x, const Eigen::VectorXd& with_cells) const;

  const Regression* regression_;
  Hand offset_deg_;
  Hand shown_ = Hand::Zero();  // 1 where the joint was seen
  Eigen::MatrixXd x_;          // seen x inputs
  Eigen::MatrixXd gain_;       // K^-1 of the cells' correlations with them
  Eigen::LLT<Eigen::MatrixXd> seen_;
  Hands weight_;
};

// With its errors on people whom it was not given: each left out in turn.
struct Calibrated {
  Regression regression;
  struct LeftOut {
    const Person* person;
    Regression others;
  };
  std::vector<LeftOut> left_out;
  Eigen::VectorXd target_error_deg2;  // mean square error of each row of `targets` times the hand
  Eigen::VectorXd target_worst_deg;   // the largest one
  double rmse_deg = 0;                // mean over the joints
};

// `targets`: sums of joints whose error is asked for beside the joints'. The people must outlive it.
Calibrated calibrate(const People& people, const InputMatrix& inputs, const Shape& shape,
                     const InputMatrix& targets);

// s_j^2 from the errors on people left out of whom `seen` moments of the whole hand were seen.
Hand scale_deg2(const Calibrated& calibrated, const InputMatrix& inputs, std::size_t seen);

// The noise of the least error on people left out.
Shape choose_shape(const People& people, const InputMatrix& inputs, bool rested);

}  // namespace flexor::posture
