// The figures of an experiment: errors, the table as bars; response_N and error_N, trial 0 of motion N with all
// compensators; posture_N, the hand at its end.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/report/gnuplot.hpp"
#include "host/report/saved.hpp"

namespace flexor::report {

struct Experiment {
  const Json& results;
  std::vector<std::string> compensators;
  const Json& motions;

  // Throws io::InputError for cells that do not fill the table.
  explicit Experiment(const Saved& saved);
  const Json& cell(std::size_t motion, std::size_t compensator) const {
    return results.at("cells").at(motion * compensators.size() + compensator);
  }
  std::optional<std::size_t> index_of(const std::string& compensator) const;
  std::string title(std::size_t motion) const;  // "4 okay"
};

struct DrawnFigure {
  Figure figure;
  std::string svg;
  std::string pdf;
  std::string undrawn;  // why both are empty
};
std::vector<DrawnFigure> draw_experiment(const Saved& saved, const Experiment& experiment);

}  // namespace flexor::report
