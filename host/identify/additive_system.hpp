// The linear system of an additive compensator (additive.hpp): a row for each sample, a column for each knot of
// each branch. For this room only.
//
// A sample whose finger rests at an end of its range has several rows: as it was, and with the readings of each
// sensor shifted as another donning would shift them. The angle there is the end's, whatever the reading says.
// Of several recordings each has columns of its own, behind those that all share.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "host/identify/additive.hpp"

namespace flexor::identify {

// The samples of all sessions in one column.
struct Stack {
  explicit Stack(const std::vector<Session>& sessions);
  // In `used`, of the first that is not before this sample.
  std::size_t place(Eigen::Index sample) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(used, sample) - used.begin());
  }

  Eigen::MatrixXd input;
  Eigen::VectorXd angle;
  std::vector<Eigen::Index> used;   // samples whose error counts, thinned where there are very many
  std::vector<Eigen::Index> begin;  // of each session, and the end
};

inline constexpr double kEnds = 0.01;  // share of the angles beyond the first guess of either limit

// The share `tail` of the used angles lies beyond either limit.
model::Saturation limits_of(const Stack& stack, double tail);
// Where an angle stops that goes on beyond what was seen: a span farther.
model::Saturation open_limits(const Eigen::VectorXd& angle);
// The ends at which the finger rests while its own sensor reads on; where it does not, the farthest angle and so much of the range.
model::Saturation limits_at_rest(const Eigen::VectorXd& angle, const Eigen::VectorXd& own, double beyond);

double range_of(const Stack& stack, Eigen::Index sensor);  // of the used readings, but for a few

// Weights of the sensors in one reading whose curve and motion are nearest to the angle, with the range of the own one's: from the
// best line on by Gauss-Newton steps, the curve fitted again for each.
// Source: W. Haerdle, P. Hall, H. Ichimura, Ann. Statist. 21 (1993) 157 (single-index models).
Eigen::VectorXd mix_of(const Stack& stack, double period_s);

// What a joint may read once the glove is put on again: the original sample, then each sensor shifted down and up (sigma points; they
// have the mean and the variance of donnings). For where the finger rests at an end alone: there all that is known is that it does.
struct Donnings {
  Donnings(model::Saturation ends, const Stack& stack, double period_s);
  bool tells(double angle_deg) const;
  double original() const { return 1 - share * sensors / spread; }  // weight of that row
  double shifted() const { return share / (2 * spread); }           // and of each of the others

  model::Saturation ends;
  double share;  // less for a short recording: it does not say how much of its time a finger rests
  double sensors;
  double spread;
  double step;  // of readings, as a share of their range
};

class System {
 public:
  System(const Stack& stack, const Branches& branches, double period_s, const model::Saturation& ends);

  Eigen::Index rows() const { return dense_.rows(); }
  Eigen::Index columns() const { return still_columns_ + dense_.cols(); }
  Eigen::Index shared_columns() const { return columns() - donning_columns_; }
  const std::vector<std::vector<double>>& knots() const { return knots_; }
  const std::vector<std::vector<double>>& radii() const { return radii_; }

  // The matrix: rows in the order of `Stack::used`, those of one sample together; columns as in Additive::value.
  Eigen::MatrixXd x() const;
  // Rows of it times coefficients; values of these rows times the matrix.
  Eigen::VectorXd estimate(Eigen::Index from, Eigen::Index count, const Eigen::VectorXd& coefficients) const;
  Eigen::VectorXd project(Eigen::Index from, const Eigen::VectorXd& values) const;
  // Adds `sign` times these rows' weighted squares, in the lower triangle.
  void add_gram(Eigen::Index from, const Eigen::VectorXd& weight, double sign, Eigen::MatrixXd& gram) const;

  const Eigen::VectorXd& angle() const { return angle_; }
  const Eigen::VectorXd& weight() const { return weight_; }      // of a sample's rows together: 1
  const Eigen::VectorXd& original() const { return original_; }  // 1, or 0 for a row of another donning
  // First row of each used sample, and the number of rows.
  const std::vector<Eigen::Index>& first() const { return first_; }

  Eigen::MatrixXd penalty(const Priors& priors) const;

 private:
  // The part of readings and plays, which is zero but for two neighbouring columns of each: 1 - share and share.
  struct Hat {
    Eigen::Index column;
    double share;
  };

  const Hat* hats(Eigen::Index row) const { return &still_[static_cast<std::size_t>(row) * hats_per_row_]; }
  void make_rows(const Stack& stack, const Donnings& donnings);
  void fill(const Stack& stack, const Branches& branches, const Donnings& donnings, double period_s);
  void fill_donnings(const Stack& stack);
  void make_penalties(const Branches& branches);

  std::vector<std::vector<double>> knots_;
  std::vector<std::vector<double>> radii_;
  std::vector<Eigen::Index> first_;
  std::size_t hats_per_row_ = 0;
  Eigen::Index still_columns_ = 0;
  std::vector<Hat> still_;                                                        // row after row
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> dense_;  // the columns after those
  Eigen::Index donning_columns_ = 0;
  Eigen::VectorXd angle_;
  Eigen::VectorXd weight_;
  Eigen::VectorXd original_;
  Eigen::MatrixXd smooth_;
  Eigen::MatrixXd straight_;
  Eigen::VectorXd plays_;  // ones where the prior counts
  Eigen::VectorXd motion_;
  Eigen::VectorXd donning_;
  Eigen::MatrixXd common_;
};

// The angle of one sensor does not turn back (monotone.cpp). `gram` (lower triangle) and `penalty` of the least-squares problem that
// `fit` solves, with its covariance. What several sensors say together is left as it is.
void make_monotone(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& penalty, Additive& fit);

}  // namespace flexor::identify
