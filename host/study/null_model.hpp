// What knows nothing of the laboratory: one constant for each compensator, whatever the gesture.
//
//   constant(c) = geometric mean over gestures 1 to 4 of the published average of c
// which is the constant with the smallest rms of ln(constant / published) there. A twin whose distance from
// the published table is no smaller tells the gestures apart no better than a constant does.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace flexor::study {

struct NullModel {
  std::map<std::string, double> error_deg_s;  // by compensator
  double fitted_log_rms = 0;                  // gestures 1 to 4, three compensators: 0.255
  double other_log_rms = 0;                   // 5 and 6: 0.437
};

NullModel null_model();

nlohmann::ordered_json to_json(const NullModel& model);

}  // namespace flexor::study
