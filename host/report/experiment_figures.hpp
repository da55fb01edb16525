// The figures of an experiment: errors, the table with its intervals; response_N and error_N, trial 0 of motion N with all
// compensators; posture_N, the hand at its end.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/report/page.hpp"

namespace flexor::report {

struct Experiment {
  const Json& results;
  std::vector<std::string> compensators;
  std::vector<std::string> colours;  // theirs
  const Json& motions;

  // Throws io::InputError for cells that do not fill the table.
  explicit Experiment(const Saved& saved);
  const Json& cell(std::size_t motion, std::size_t compensator) const {
    return results.at("cells").at(motion * compensators.size() + compensator);
  }
  std::optional<std::size_t> index_of(const std::string& compensator) const;
  std::string title(std::size_t motion) const;  // "4 okay"
};

double mean_error(const Json& cell);

Chart errors_chart(const Experiment& experiment);
// A row of figures: response, error and final posture. Throws io::InputError for traces that were cut off.
void add_motion(Page& page, const Saved& saved, const Experiment& experiment, std::size_t motion);

}  // namespace flexor::report
