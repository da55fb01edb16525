// A glove that was put on again: the model that reads it as it was read, from whatever there is.
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

#include "host/identify/readings.hpp"
#include "host/model/correction.hpp"
#include "host/model/model.hpp"
#include "host/model/range_count.hpp"
#include "host/recording/clock.hpp"

namespace flexor::identify {

// How a new donning differs from the one that a model was made in, before anything of it is seen: the standard deviation of the
// difference of two; python/flexor/donning.py writes it. Lengths are shares of a sensor's span: from the reading that
// 2 % of its samples do not exceed to that of 98 %.
//
// {"schema": "flexor-donning-prior", "schema_version": 1, "sessions", "shift_sd", "log_gain_sd", "motion_sd", "reach_sd",
//  "density_sd", "alike"}; files without "alike" are of before it was known, and have the shipped one.
struct Prior {
  int sessions = 0;        // that it was learnt from
  double shift_sd = 0;     // of where a sensor's readings lie
  double log_gain_sd = 0;  // of how far apart they lie
  double alike = 0;        // correlation of the shifts of one glove's sensors
  // What quantiles of another stretch of motion differ by though the glove stayed on:
  double motion_sd = 0;   // all together
  double reach_sd = 0;    // the distance of the ends
  double density_sd = 0;  // each quantile between the ends, by itself
};

inline constexpr double kGeneralWeight = 4;  // recordings that a general prior counts as
inline constexpr double kMostAlike = 0.95;

// Somewhat narrower than nine sessions of one three-finger glove over 4.5 months: docs/donning.md has the figures.
Prior shipped_prior();

// Throws io::InputError naming `source` and place.
Prior prior_from_json(const std::string& text, const std::string& source);

// Of one sensor: what the model's own recordings say, weighed against `general`, which counts as kGeneralWeight.
Prior prior_of(const model::Input& input, const Prior& general);

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
  bool gain_is_known = true;  // false: motion alone, which may be a hand that reached less far
  int reversals = 0;          // of the motion, in the log that shows most
  double covered = 0;         // of its span there
  std::string kept;           // why it was not applied
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
