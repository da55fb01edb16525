// A trial's plan and its result on their way through a pipe: the same bits on the other side.
//
// No documents: nobody edits them, and only the same version reads them. Numbers that JSON has no word for are
// "nan", "inf" and "-inf". Readers throw io::InputError, or nlohmann's exceptions where a member is missing.
#pragma once

#include <nlohmann/json.hpp>

#include "host/twin/simulation.hpp"

namespace flexor::twin {

nlohmann::ordered_json exact_json(double number);
double number_of(const nlohmann::ordered_json& json);

nlohmann::ordered_json exact_json(const Motion& motion);
Motion motion_of(const nlohmann::ordered_json& json);

nlohmann::ordered_json exact_json(const TrialInput& input);
TrialInput trial_input_of(const nlohmann::ordered_json& json);

// One vector for each finger.
nlohmann::ordered_json exact_json(const std::array<std::vector<float>, kFingers>& angles);
std::array<std::vector<float>, kFingers> angles_of(const nlohmann::ordered_json& json);

nlohmann::ordered_json exact_json(const Trial& trial);
Trial trial_of(const nlohmann::ordered_json& json);

}  // namespace flexor::twin
