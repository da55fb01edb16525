// A chain of blocks with dynamics (structure_text.hpp) fitted to one joint from one sensor, by fit.hpp.
//
// Several recordings are fitted one behind the other; the first two seconds of each but the first do not count. A lag before
// the chain is a first-order low-pass of the reading; its time constant is searched for the least fitted error, and
// it is left out where that is no less without it. Poles that would let a held angle drift by more than kMostDrift_deg are made
// quicker until it does not, unless the sensor creeps and that pays (creep_refusal). Cross-validation as in folds.hpp, each fold
// from the parameters of the whole.
// A stop before the first fit is io::Cancelled; after it the chain is there and is finished.
#pragma once

#include <vector>

#include "host/identify/joint_fit.hpp"
#include "host/identify/structure_text.hpp"

namespace flexor::identify {

// `initial`: one start more for its parameters. Cross-validated only where the fitted error is below `least_deg`: what another errs
// by on what it did not see. Throws io::JobError where the fit cannot be done.
JointFit fit_chain(const Chain& wanted, const std::vector<Session>& sessions, const model::Model& inputs,
                   const JointMap& joint, const std::optional<Initial>& initial, double least_deg,
                   const Step& step);

}  // namespace flexor::identify
