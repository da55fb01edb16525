// What is asked of boards and what they answer on its way through a pipe, as host/twin/exact_json.hpp does it:
// the same bits on the other side.
#pragma once

#include <nlohmann/json.hpp>

#include "host/study/boards.hpp"

namespace flexor::study {

nlohmann::ordered_json exact_json(const deploy::Glove& glove);
deploy::Glove glove_of(const nlohmann::ordered_json& json);

nlohmann::ordered_json exact_json(const GloveFigures& figures);
GloveFigures glove_figures_of(const nlohmann::ordered_json& json);

nlohmann::ordered_json exact_json(const HandFigures& figures);
HandFigures hand_figures_of(const nlohmann::ordered_json& json);

}  // namespace flexor::study
