// A glove that was put on anew: the model that reads it as it was read, from whatever there is.
//
// Evidence: seconds of ordinary motion (quantiles of the readings), held poses (readings that are known), a camera (angles).
// All of it goes into one estimate (line_estimate.hpp). Shifts come first; a gain is taken only where the evidence narrows it.
// A stretch without angles counts only where it shows a whole cycle (three turns of 30 degrees, or one bend there and back
// nearly from end to end) and most of the sensor's span. What is found is taken for a sensor where it is larger than 0.7 of its
// standard errors; otherwise the sensor stays as it was. What held poses alone tell is taken only where it makes the angles
// better by 1.3 standard errors, the surest sensors together: poses are as good as their wearer. Each log of motion
// is looked at by itself: of a finger that shows no whole cycle in one, that one says nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/identify/donning_prior.hpp"
#include "host/identify/readings.hpp"
#include "host/model/correction.hpp"
#include "host/model/model.hpp"
#include "host/model/range_count.hpp"
#include "host/recording/clock.hpp"

namespace flexor::identify {

// Readings on the model's grid; of each input those that are good, pauses left out.
struct Motion {
  std::vector<std::vector<double>> reading;
};

// Angles of joints beside the readings, every sample of the grid.
struct Seen {
  struct Angles {
    std::size_t joint = 0;
    std::vector<double> angle_deg;
    std::vector<std::uint8_t> use;
  };
  std::vector<std::vector<double>> reading;  // of each input
  std::vector<Angles> joints;
};

struct RecalibrationRequest {
  model::Model model;
  Prior prior = shipped_prior();
  std::vector<Motion> motion = {};  // of each log
  Held held = {};
  std::optional<Seen> seen = {};
  std::vector<std::string> lacking = {};  // evidence that was given and cannot be used, in words
};

struct RecalibratedSensor {
  std::string name;
  bool applied = false;
  model::Correction correction;  // none unless applied
  double shift_se = 0;           // of what the sensor's middle is taken for, in its unit
  double gain_se = 0;
  bool gain_is_told = true;  // false: motion alone, which may be a hand that reached less far
  int reversals = 0;         // of the motion, in the log that shows most
  double covered = 0;        // of its span there
  std::string kept;          // why it was not applied
};

struct RecalibratedJoint {
  std::string name;
  double change_deg = 0;      // mean of its angles' change, over the readings that the model was made from
  double change_rms_deg = 0;  // likewise its root mean square
  double se_deg = 0;          // that is left
};

// What a log holds beside what the model knows.
struct LogRanges {
  std::string file;
  std::vector<std::string> columns;
  model::RangeCount ranges;
};

struct Recalibration {
  model::Model model;  // as it was, where nothing was applied
  bool applied = false;
  std::vector<RecalibratedSensor> sensors;
  std::vector<RecalibratedJoint> joints;
  std::vector<std::string> wanted;   // what the evidence lacks; never empty unless something was applied
  std::vector<std::string> misfits;  // sensors that no donning explains
  std::vector<std::string> notes;
  std::optional<recording::Clock> clock;  // of files with a camera
  std::vector<LogRanges> logs;            // of files
};

// Throws io::InputError: no evidence, a model that does not say what it was made from.
Recalibration recalibrate(const RecalibrationRequest& request);

}  // namespace flexor::identify
