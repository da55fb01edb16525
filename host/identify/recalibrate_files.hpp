// recalibrate on logs: files or recordings in, the model and its report out.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/identify/recalibrate.hpp"
#include "host/recording/csv.hpp"

namespace flexor::identify {

struct RecalibrationFiles {
  model::Model model;
  recording::Log recording;  // empty: none
  std::vector<std::string>
      poses;  // "open" and "fist", the one that poses_log begins with first; or one of them
  recording::Log poses_log;
  recording::Log pair_sensor;
  recording::Log pair_camera;
  std::string map;                  // joint=column,... of the camera's file; empty: by name
  std::vector<std::string> inputs;  // the logs' columns for the model's inputs; empty: those in the model
  recording::TimeOptions time;
  std::filesystem::path prior;  // empty: the shipped one
};

// A log with a column for each input of the model, in their order.
Motion motion_in(const recording::Recording& log, const model::Model& model);
// `poses`: "open" and "fist" in the order in which they were held, each as often as one likes, or one of them. Inputs without poses in the model do not count. Throws io::InputError: another
// pose, a model without poses; io::JobError: they are not found.
Held poses_in(const std::vector<std::string>& poses, const recording::Recording& log,
              const model::Model& model);

// Poses that are not found, a camera whose clock is not: what the other evidence tells, and in `wanted` what that one lacks.
// Throws io::InputError: files that cannot be read as what they are given as.
Recalibration recalibrate_files(const RecalibrationFiles& request);

// See docs/json.md.
nlohmann::ordered_json to_json(const Recalibration& result);

}  // namespace flexor::identify
