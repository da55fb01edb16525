// What was measured of deployed firmware: the figures, as tables and as the files that their report is drawn from.
#pragma once

#include "host/deploy/config.hpp"
#include "host/deploy/wiring.hpp"
#include "host/study/boards.hpp"

namespace flexor::study {
struct LatencyBudget {
  struct Stage {
    double mean_ms = 0;
    double min_ms = 0;
    double max_ms = 0;
  };
  int edges = 0;  // that came through
  int lost = 0;   // of which the frame that told them first was lost on the way
  std::array<Stage, kLatencyStages.size()> stage{};
  Stage total;
};
// Of those that came through out of `asked`.
LatencyBudget budget_of(const std::vector<Latency>& edges, int asked);
std::string latency_table(const LatencyBudget& budget);
nlohmann::ordered_json to_json(const LatencyBudget& budget);
// results.json and latency.csv. Throws io::InputError.
void save_results(const LatencyBudget& budget, const std::string& title, const std::filesystem::path& folder);

// All that `flexor deploy` says.
struct Deployment {
  deploy::Glove glove;
  GloveFigures glove_figures;
  HandFigures hand_figures;
  deploy::Error error;
  std::string recording;    // what the error was measured over, beside the whole range
  std::string calibration;  // how counts become what the model reads, in words
  double divider_kohm = 0;  // between each strip and 5 V
  std::string folder;       // where the user finds it
};

// The sample period's parts, ms.
struct TimeBudget {
  double period_ms = 0;
  double adc_ms = 0;
  double compute_ms = 0;  // worst, frame sealed
  double uart_ms = 0;     // of a frame
  double frame_period_ms = 0;
};
TimeBudget time_budget(const Deployment& deployment);

// What it means to the user, then what to do next, then what it costs and what of the boards that is.
std::string deployment_table(const Deployment& deployment);
nlohmann::ordered_json to_json(const Deployment& deployment);
// results.json. Throws io::InputError.
void save_results(const Deployment& deployment, const std::filesystem::path& folder);

}  // namespace flexor::study
