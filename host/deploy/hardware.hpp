// A glove and a hand of this hardware that run this model. A key of none: plain frames.
//
// All throw io::InputError, one line with the figure and the mend.
#pragma once

#include "host/deploy/calibration.hpp"
#include "host/model/hardware.hpp"

namespace flexor::deploy {

// A model of the divider's alpha reads the hardware's divider, one of counts the ADC's counts as they are, any other needs a
// calibration.
Glove glove_for(const model::Hardware& hardware, const model::Model& model, const Key& key,
                const CalibrationDocument& calibration = {});
// The same for a glove that runs: what corrects its sensors stays in the model, since the board's tables are those of its image.
Glove glove_that_runs(const model::Hardware& hardware, const model::Model& model, const Key& key,
                      const CalibrationDocument& calibration = {});

// Loop, limits and end stops as they are: the published hand.
Hand unprotected_hand(const model::Hardware& hardware, const model::Model& model, const Key& key);

// The same motors and joints with a loop that one may let loose: commands inside the joints' ends, bounded effort and speed,
// stall detection, feed-forward of the motor's own back-EMF. Refuses motors that would not move within these bounds.
Hand safe_hand(const model::Hardware& hardware, const model::Model& model, const Key& key);

// The model with the angles of this hand: where a finger's joint states ends (model::Ends) that lie farther off the hand's than
// a tenth of its range, open hand comes upon open hand and fist upon fist. `notes` gets a line for each. No angle is beyond the ends of
// the hand, which it would press into its stops.
model::Model on_hand(model::Model model, const model::Hardware& hardware, std::vector<std::string>& notes);

}  // namespace flexor::deploy
