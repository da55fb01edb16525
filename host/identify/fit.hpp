// Fits one structure to one finger's recording.
//
// Minimises sum rho(y_k - predicted_k) over the used samples, rho the pseudo-Huber loss
//   rho(r) = delta^2 (sqrt(1 + (r / delta)^2) - 1),   delta = 2.5 robust standard deviations of a first fit,
// by Levenberg-Marquardt with bounds (levenberg_marquardt.hpp), analytic Jacobian, from several starts for the poles, plays and
// dead zone, and from `initial`; what is linear in the parameters starts at its least-squares value. Poles are -exp(theta):
// stable by construction. Of a curve before and one behind the dynamics the first keeps the values of its ends, since a scale
// between the two changes nothing. Predictions simulate freely from the input alone; they never see the measured
// angle.
//
// Standard errors: sandwich A^-1 S A^-1 with A = sum rho'' J J' and S the Bartlett-weighted sum of the
// scores' autocovariances (Newey, West, Econometrica 55 (1987) 703), so that they hold for residuals that are
// neither Gaussian nor white. A is factored by SVD after column scaling, and its condition number reported.
//
// What the data cannot tell is refused: the parameter gets no standard error.
// A limit takes that of safe_limits(); a pole, tap, radius or weight stays where the fit left it, one of many that fit
// as well. A curve's values stay within the measured angles and one span of them on either side;
// a knot that hardly any sample tells lies on the line between its neighbours, beyond the last one at its
// value.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/predictor.hpp"
#include "host/model/channel.hpp"

namespace flexor::identify {

// One finger on a uniform grid. Equal lengths; `use` is 1 where a sample's error counts (no gap, fitted
// part).
struct Data {
  std::string channel;  // a finger's name, for messages
  double period_s = 0;
  Eigen::VectorXd input;      // raw sensor reading
  Eigen::VectorXd angle_deg;  // measured
  std::vector<std::uint8_t> use;
  // Behind these samples may lie copies of the recording, as it could read put on anew: how many samples are its own, and what
  // each sample counts.
  Eigen::Index own = 0;  // 0: all are, and count alike
  Eigen::VectorXd weight = {};

  Eigen::Index size() const { return own > 0 ? own : input.size(); }
};

struct Options {
  std::optional<std::size_t> only_start;  // of four; none: all
  double slowest_s = 0;                   // no pole is slower; 0: a tenth of the recording
  std::optional<Knots> knots;             // none: quantiles of the input
  std::optional<model::Channel> initial;  // one start more
};

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
  double effective = 0;        // parameters that the data determine
  double condition = 0;  // of a chain: of the column-scaled Jacobian; of a sum: of its regularised system
  int iterations = 0;    // of a chain, from its parameters' initial values
  int start = 0;         // of a chain, whose values these are, from 1
};

struct Summary : Fitted {
  Eigen::VectorXd theta;
  Knots knots;
  Eigen::VectorXd predicted_deg;  // whole recording, saturated like the model
  model::Channel channel;         // blocks, saturation and rest angle; the caller names it and its input
};

// Throws io::JobError, naming the channel: fewer used samples than five times the parameters, constant input
// or angle, a dead zone where no sample lies, no convergence from any start.
Summary fit(const Structure& structure, const Data& data, const Options& options = {});

// Samples whose error counts, in their order; of the recording's own alone, or of its copies too.
std::vector<Eigen::Index> used_rows(const Data& data, bool own = false);

}  // namespace flexor::identify
