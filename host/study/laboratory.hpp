// The experiment in one laboratory, a set of the twin's parameters: the glove is worn and recorded once (glove_recording.hpp), the
// compensators are fitted to that recording (glove_fit.hpp), and the motions are played with the plan's compensators and the
// fitted ones. Which laboratories are plausible is the Python package's question (flexor.laboratories).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/study/trials.hpp"

namespace flexor::study {

struct LaboratoryPlan {
  Plan plan;  // without a folder
  std::vector<Scenario> scenarios =
      {};  // also played, with the compensators that were fitted in ordinary use
  double rate_hz = kPublishedRate_hz;
  std::uint64_t glove_seed = 1001;  // of the recording
};

// {"cells": [{"scenario", "gesture", "compensator", "error_deg_s"}], "lead_s", "shapes": [...]}: E_T, mean of the trials; "scenario" is
// "" in ordinary use; the lead that is predicted, null where the lag lies outside the search. Throws as run(), and io::JobError.
nlohmann::ordered_json play_laboratory(const LaboratoryPlan& plan);

}  // namespace flexor::study
