// Fits one structure to one finger's recording.
//
// Minimises sum rho(y_k - predicted_k) over the used samples, rho the pseudo-Huber loss
//   rho(r) = delta^2 (sqrt(1 + (r / delta)^2) - 1),   delta = 2.5 robust standard deviations of a first fit,
// by Levenberg-Marquardt with bounds (levenberg_marquardt.hpp), analytic Jacobian, from several starts for the poles, plays and
// dead zone, and from `initial`: some steps of plain least squares from each, to the recording without its copies, and the best
// of the two that are lowest then goes on; what is linear in the parameters starts at its least-squares value. Poles are
// -exp(theta): stable by construction. Of a curve before and one behind the dynamics the first keeps the values of its ends,
// since a scale between the two changes nothing. Predictions simulate freely from the input alone; they never see the measured
// angle.
//
// Standard errors: sandwich A^-1 S A^-1 with A = sum rho'' J J' and S the Bartlett-weighted sum of the
// scores' autocovariances (Newey, West, Econometrica 55 (1987) 703), so that they hold for residuals that are
// neither Gaussian nor white. A is factored by SVD after column scaling, and its condition number reported.
//
// What the data cannot tell is refused: the parameter gets no standard error.
// A limit that no sample is beyond is where the finger rests, else a span of the angles beyond them, up to which curves go on as
// straight as at their ends (Predictor::go_on); a pole, tap, radius or weight stays where the fit left it, one of many that fit as well.
// A curve's values stay within the measured angles and one span of them on either side; a normal prior has them beside the line
// between their neighbours by 5 % of the span, so that a curve goes on straight where hardly any sample determines it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/additive.hpp"
#include "host/identify/predictor.hpp"
#include "host/model/channel.hpp"

namespace flexor::identify {

// One finger on a uniform grid. Equal lengths.
struct Data {
  std::string channel;  // a finger's name, for messages
  double period_s = 0;
  Eigen::VectorXd input;      // raw sensor reading
  Eigen::VectorXd angle_deg;  // measured
  Eigen::VectorXd
      weight;  // of a sample's error; 0: it does not count, as in a gap or a part that is held out
  // Behind these samples may lie copies of the recording, as it could read when re-donned: how many samples are its own.
  Eigen::Index own = 0;  // 0: all are

  Eigen::Index size() const { return own > 0 ? own : input.size(); }
};

// Another chain of the same blocks, from which a fit begins.
struct Initial {
  model::Channel chain;
  bool gain_alone = false;  // its gain and the width of its dead zone are fitted; all else stays as it is
};

// Where the search begins, and at `initial`, if there is one, too: at all its own starts, at the first of them, or at none.
enum class From { all, first, initial };

struct ChainOptions {
  From from = From::all;
  double deviation_deg = 0;      // of the residuals, which sets the loss; 0: of a first fit by least squares
  double cost_tolerance = 1e-7;  // of the last search, relative
  double slowest_s = 0;          // no pole is slower; 0: a tenth of the recording
  std::optional<Knots> knots;    // none: quantiles of the input
  std::optional<Initial> initial;  // one start more
};

struct Summary : Fitted {
  Eigen::VectorXd theta;
  Knots knots;
  double deviation_deg = 0;
  Eigen::VectorXd predicted_deg;  // whole recording, saturated like the model
  model::Channel channel;         // blocks, saturation and rest angle; the caller names it and its input
};

// Throws io::JobError, naming the channel: fewer used samples than five times the parameters, constant input
// or angle, a dead zone where no sample lies, no convergence from any start; io::InputError: an initial model of other
// blocks, or without the dead zone that is to be fitted.
Summary fit(const Structure& structure, const Data& data, const ChainOptions& options = {});

// Samples whose error counts, in their order; of the recording's own alone, or of its copies too.
std::vector<Eigen::Index> used_rows(const Data& data, bool own = false);

// Covariance of fitted parameters. Rows: the used samples in order of time. `residual` r_k, `jacobian` d(predicted)/d(theta) of the free
// parameters. delta: of the pseudo-Huber loss; infinite for plain least squares. `prior`: rows of the parameters that the fit holds near zero
// beside them, or none.
struct Uncertainty {
  Eigen::MatrixXd covariance;
  double condition = 0;
  // Free parameters, by column, that the data cannot tell: a column of zeros, or the largest part of a
  // direction whose singular value is below 1e-7 of the largest. The covariance is meaningless while there
  // are any.
  std::vector<int> undetermined;
};

Uncertainty uncertainty(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian, double delta,
                        const Eigen::MatrixXd& prior);

// Samples of one recording, both ends included, and how many on either side are not fitted.
struct Block {
  Eigen::Index first;
  Eigen::Index last;
  Eigen::Index guard;
};
using Fold = std::vector<Block>;

// Cross-validation: which samples are left out together, the same for every candidate. Blocks of samples in time, six of each
// recording, of two recordings the same parts, since they may be one motion; whole recordings where there are more than two. Beside
// each block a guard of a second, a quarter of the block at most, is not fitted either.
// `used`: the samples whose error counts, ascending; `begin`: the first sample of each recording, and the end.
std::vector<Fold> folds_of(const std::vector<Eigen::Index>& used, const std::vector<Eigen::Index>& begin,
                           double period_s);

// A chain's fits to all but each fold: what `options` does not give (knots, a start, the width of the loss) comes from that part
// alone, as the parameters do. Throws io::JobError when one cannot be fitted.
std::vector<Summary> fit_folds(const Structure& structure, const Data& data, const std::vector<Fold>& folds,
                               const ChainOptions& options);

}  // namespace flexor::identify
