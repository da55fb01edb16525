// From a sensor's edge to the motor, stage by stage.
#pragma once

#include <vector>

#include "cosim/co_simulation.hpp"
#include "host/study/boards.hpp"

namespace flexor::cosim {

// As study::Boards::latency.
std::vector<study::Latency> latency(const twin::Parameters& parameters, const model::Model& model, int edges,
                                    std::uint64_t seed);

}  // namespace flexor::cosim
