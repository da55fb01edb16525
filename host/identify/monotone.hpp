// The prior that a sensor's angle does not turn back; for this room only.
//
// Of one sensor, from a turn on while more and more plays begin to move: the angle goes on rising or falling with the reading, but
// where it goes back by more than ten standard errors, which is beyond doubt. Where it goes back by less it may not,
// which is the quadratic programme
//   min_w (w - free)' (gram + penalty) (w - free),   gain w >= 0 there.
// Solved by its dual. A way back is judged as a whole: it is sure where any part of it is. The
// smoothness of the curves is in the error (B. Silverman, JRSS B 47 (1985) 1), in the scale of the bootstrap.
#pragma once

#include "host/identify/additive.hpp"

namespace flexor::identify {

// `gram` (lower triangle) and `penalty` of the least-squares problem that `fit` solves, with its covariance. What several
// sensors say together is left as it is.
void make_monotone(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& penalty, Additive& fit);

}  // namespace flexor::identify
