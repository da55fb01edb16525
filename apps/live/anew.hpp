// What came of a glove that was put on anew: the answer of `flexor recalibrate --json`, finger by finger.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "host/model/model.hpp"

namespace flexor::live {

struct AnewResult {
  bool applied = false;  // there is a model that fits better
  bool is_off = false;   // by more than it is sure of, at some finger
  // Of each joint: name, before_deg, after_deg, and a verdict on each of its sensors: "fitted", or why it stays as it was, which
  // begins with "kept", "wanted" or "does not fit".
  nlohmann::ordered_json fingers = nlohmann::ordered_json::array();
  std::string wanted;   // what the motion lacked; "": nothing
  std::string misfits;  // sensors that no donning explains; "": none
};

// `old`: the model that was recalibrated. Before: how far off its angles are by the new calibration, root mean square. After:
// the standard error that is left. Throws where the answer is none of that model.
AnewResult anew_result(const model::Model& old, const nlohmann::ordered_json& said);

}  // namespace flexor::live
