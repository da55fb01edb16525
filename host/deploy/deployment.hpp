// A deployment in words, for people and for the files that its report is drawn from; what was measured of it comes as data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "host/deploy/config.hpp"
#include "host/deploy/wiring.hpp"

namespace flexor::deploy {

// What simulated boards are measured at.
struct CycleStatistic {
  std::uint64_t count = 0;
  std::uint64_t sum = 0;
  std::uint64_t worst = 0;
  void add(std::uint64_t cycles) {
    ++count;
    sum += cycles;
    worst = cycles > worst ? cycles : worst;
  }
  double mean() const { return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0; }
};

struct GloveFigures {
  std::size_t samples = 0;
  std::size_t frames = 0;
  std::size_t angles = 0;      // compared with the host's runtime
  std::size_t mismatches = 0;  // messages of which one bit differs, or that never came
  CycleStatistic step;  // compensator, five channels; without the first, which starts it; markers subtracted
  CycleStatistic sample;  // all of a sample's work until a frame is sealed
  int stack_bytes = 0;
  double awake_share = 0;
};

struct HandFigures {
  CycleStatistic tick;  // five position loops, motors included
  int stack_bytes = 0;
  double awake_share = 0;
};

// All that `flexor deploy` reports.
struct Deployment {
  model::Hardware hardware;
  Glove glove;
  GloveFigures glove_figures;  // without samples nothing was measured: there is no simulation of the boards
  HandFigures hand_figures;
  Error error;
  std::string recording;    // what the error was measured over, beside the whole range
  std::string calibration;  // how counts become what the model reads, in words
  std::string folder;       // where the user finds it
};

Json to_json(const Deployment& deployment);
// results.json. Throws io::InputError.
void save_results(const Deployment& deployment, const std::filesystem::path& folder);

}  // namespace flexor::deploy
