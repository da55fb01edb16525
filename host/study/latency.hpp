// The time from a sensor's edge to the motor, stage by stage, over many edges: a table, and the files that its report is drawn
// from.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/io/io.hpp"
#include "host/study/boards.hpp"

namespace flexor::study {

// Of those that came through out of `asked`: "edges", "lost" (of which the frame that told them first was lost on the way),
// "stages" and "total", each with mean_ms, min_ms, max_ms. Throws io::JobError where none did.
Json budget_of(const std::vector<Latency>& edges, int asked);

// results.json and latency.csv. Throws io::InputError.
void save_results(const Json& budget, const std::string& title, const std::filesystem::path& folder);

}  // namespace flexor::study
