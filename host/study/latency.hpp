// The time from a sensor's edge to the motor, stage by stage, over many edges: a table, and the files that its report is drawn
// from.
#pragma once

#include "host/study/boards.hpp"

namespace flexor::study {

struct LatencyBudget {
  struct Row {
    std::string name;
    double mean_ms = 0;
    double min_ms = 1e9;
    double max_ms = 0;
  };
  int edges = 0;          // that came through
  int lost = 0;           // of which the frame that told them first was lost on the way
  std::vector<Row> rows;  // stage by stage, and their sum: "total"
};
// Of those that came through out of `asked`.
LatencyBudget budget_of(const std::vector<Latency>& edges, int asked);
nlohmann::ordered_json to_json(const LatencyBudget& budget);
// results.json and latency.csv. Throws io::InputError.
void save_results(const LatencyBudget& budget, const std::string& title, const std::filesystem::path& folder);

}  // namespace flexor::study
