// A chain of blocks with dynamics (structure_text.hpp) fitted to one joint from one sensor, by fit.hpp.
//
// Several recordings are fitted one behind the other; the first two seconds of each but the first do not count. A lag before
// the chain is a first-order low-pass of the reading; its time constant is searched for the least fitted error, and
// it is left out where that is no less without it. Poles that would
// let a held angle drift by more than `most_drift_deg` are made quicker until it does not. Cross-validation as in folds.hpp.
// A stop before the first fit is io::Cancelled; after it the chain is there and is finished.
#pragma once

#include <vector>

#include "host/identify/joint_fit.hpp"
#include "host/identify/structure_text.hpp"

namespace flexor::identify {

// Throws io::InputError for several sensors, io::JobError where the fit cannot be done.
// `initial`: one start more for its parameters.
JointFit fit_chain(const Chain& wanted, const std::vector<Session>& sessions, const model::Model& inputs,
                   const JointMap& joint, const std::optional<model::Channel>& initial, double most_drift_deg,
                   const Step& step);

// As a candidate among others: from its poles' best start, as slow as the data say, and cross-validated only where its fitted error is below
// `least_deg`, which another has on what it did not see. Throws io::JobError where the fit cannot be done.
JointFit fit_rival(const Chain& wanted, const std::vector<Session>& sessions, const model::Model& inputs,
                   const JointMap& joint, double least_deg);

}  // namespace flexor::identify
