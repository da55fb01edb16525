// What changed between sessions of one glove: of each sensor in each session, against the mean of all of them.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/identify/donning_prior.hpp"
#include "host/recording/time.hpp"

namespace flexor::identify {

// Shares of the sensor's span, which is that of the sessions' mean quantiles. Intervals are those of 95 % of resampled
// tenths of the session.
struct Change {
  double value = 0;
  double low = 0;
  double high = 0;
};

struct SensorChange {
  std::string sensor;
  Change shift;      // of the middle of its readings
  Change log_gain;   // of the distance of their ends
  double shape = 0;  // root mean square that shift and gain leave, over the quantiles
  double noise = 0;  // of one reading: from second differences, robust
};

struct SessionChange {
  std::string name;
  double seconds = 0;
  std::vector<SensorChange> sensors;  // that were read in it
};

struct Sessions {
  std::vector<SessionChange> sessions;
  Prior prior;  // the shipped one, with the shifts and gains of these sessions, and how alike they are
};

struct Log {
  std::string name;
  std::vector<double> t_s;
  std::vector<std::vector<double>> reading;  // of each sensor; NaN: missing
  std::vector<std::string> unit = {};        // likewise; empty: not said
};

// Throws io::InputError for fewer than three sessions, a sensor that stands still in one, or that spans ten times as much
// there as in most, or a tenth. `seed` of the resampling.
Sessions compare(const std::vector<Log>& logs, const std::vector<std::string>& sensors, unsigned seed);

// Columns by name; none: those that are called like fingers. Throws as the readers do.
Sessions compare_files(const std::vector<std::filesystem::path>& files, std::vector<std::string> sensors,
                       const recording::TimeOptions& time);

nlohmann::ordered_json to_json(const Sessions& sessions);

// For a report: results.json in `folder`, which is made.
void save_results(const Sessions& sessions, const std::filesystem::path& folder);

}  // namespace flexor::identify
