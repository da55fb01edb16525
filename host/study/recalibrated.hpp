// A glove of the twin that was put on anew and recalibrated before its trial, by what `flexor recalibrate` runs.
#pragma once

#include <string>
#include <vector>

#include "host/model/model.hpp"
#include "host/study/catalogue.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::study {

// What a compensator's strips read where it was made; where it does not say, what the first of the others says. All
// are recalibrated alike, so that what is compared is what they make of it.
model::Model with_readings_of(const std::vector<Compensator>& compensators, model::Model model);

// Trial `number` as it is played once its compensator was recalibrated by what the glove reads before it:
//   poses    an open hand and a fist, two seconds each, each finger up to 2 degrees beside where it should be held;
//            once more for four and for eight seconds where the reading was not still; the model stays if it never is
//   motion   short_motion(), thirty seconds without a camera
// A compensator whose strips are not known stays as it is. Throws io::InputError: another kind.
twin::TrialInput recalibrated(twin::TrialInput input, const std::string& by, std::uint64_t number);

}  // namespace flexor::study
