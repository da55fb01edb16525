// What an experiment found, as files that its report is drawn from: results.json, and in traces/ trial 0 of every motion
// with every compensator as the cameras saw it (t_s; for each finger NAME_finger_deg and NAME_hand_deg).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "host/study/trials.hpp"

namespace flexor::study {

struct ScenarioResult {
  Scenario scenario;
  Result result;
};

// The worst compensator's: fastest hit of any trial, mean of a trial's pressing over the motions.
struct Stops {
  double impact_deg_s = 0;
  double pressed_s = 0;
};
Stops stops_of(const Result& result);

// Its settings and its cells.
nlohmann::ordered_json to_json(const ScenarioResult& result, const Plan& plan);

// Every file appears whole or not at all, results.json last. Throws io::InputError when it cannot be written, and
// io::Cancelled.
void save_results(const Plan& plan, const Result& result, const std::vector<ScenarioResult>& scenarios,
                  const std::filesystem::path& folder);

}  // namespace flexor::study
