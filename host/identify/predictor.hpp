// The chain of blocks as a function of its parameters, with the analytic Jacobian.
//
// Parameters theta, in this order, those that the structure has:
//   dead zone      lower edge, width
//   plays          radii, then weights
//   input curve    values at the knots
//   affine         gain, offset (where there is no curve)
//   lti            log a_i of the poles -a_i, then taps c_1 .. c_{n-1}  (c_0 = 0: no direct feedthrough)
//   pair           log of the frequency, damping, then taps c_0, c_1 (runtime/compensator/pole_pair.hpp)
//   output curve   values at the knots
//   saturation     lower, upper limit
//
// The Jacobian runs through the chain with the signal: static blocks multiply by their slope, the LTI filters
// every parameter, and derivatives of matrix exponentials come from host/model/discrete.hpp. At kinks it is one-sided.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "host/model/channel.hpp"

namespace flexor::identify {

// Which blocks a chain has, in this order.
struct Structure {
  bool dead_zone = false;   // an input dead zone with fitted edges
  int plays = 0;            // play operators, 0 to 4
  int input_knots = 0;      // input curve, 0 (gain and offset instead) or 2 to 16
  int order = 0;            // poles, 0 to 3
  bool pair = false;        // two, which are complex
  int output_knots = 0;     // output curve, 0 or 2 to 16
  bool saturation = false;  // fitted saturation limits

  int taps() const { return pair ? 2 : std::max(order - 1, 0); }
  bool operator==(const Structure&) const = default;
};

inline constexpr int kDefaultKnots = 10;
inline constexpr int kDefaultOrder = 2;
inline constexpr int kDefaultPlays = 2;

// Of a chain; its limits are fitted.
Structure structure_of(const model::Channel& channel);

// Knot positions, fixed before the fit; empty where the structure has no such curve.
struct Knots {
  std::vector<double> input;   // in the unit of the signal that enters the curve
  std::vector<double> output;  // likewise, after the LTI block
};

// Where each block's parameters start in theta; -1 where the structure has none.
struct Layout {
  explicit Layout(const Structure& structure);

  int dead_zone = -1;
  int radii = -1;
  int weights = -1;
  int input_curve = -1;
  int affine = -1;
  int log_rates = -1;
  int taps = -1;
  int output_curve = -1;
  int saturation = -1;
  int size = 0;
  std::vector<std::pair<int, int>> curves;  // where each begins, and its knots
};

// A parameter as people know it: its value is a function of theta, its gradient turns a covariance of theta
// into a standard error.
struct NamedParameter {
  std::string name;  // "dead zone upper edge", "pole 1 (rad/s)", ...
  double value = 0;
  Eigen::VectorXd gradient;
};

// A row for each sample, a column for each parameter.
using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Predictor {
 public:
  // input: one value for each sample, evenly spaced by period_s.
  Predictor(const Structure& structure, Knots knots, Eigen::VectorXd input, double period_s);

  const Structure& structure() const { return structure_; }
  const Layout& layout() const { return layout_; }
  const Knots& knots() const { return knots_; }
  const Eigen::VectorXd& input() const { return input_; }
  double period_s() const { return period_s_; }

  // Predicted angle (n); jacobian if not null. Saturates only if the structure does.
  Eigen::VectorXd predict(const Eigen::VectorXd& theta, Jacobian* jacobian) const;

  std::vector<NamedParameter> named(const Eigen::VectorXd& theta) const;

  // The blocks that theta describes; the caller adds names, ranges and, where none is fitted, the saturation.
  model::Channel channel(const Eigen::VectorXd& theta) const;

  // Its curves go on beyond what they were fitted to as straight as their outermost pieces, by half their range or to these limits,
  // unless such a piece turns back.
  void go_on(const model::Saturation& limits, Eigen::VectorXd& theta);

  // The other way round, curves read at the knots. Throws io::InputError where the channel has other blocks than the structure.
  Eigen::VectorXd theta(const model::Channel& channel) const;

 private:
  Structure structure_;
  Layout layout_;
  Knots knots_;
  Eigen::VectorXd input_;
  double period_s_;
};

}  // namespace flexor::identify
