// Which sensors and which measured angle belong to each joint, as they were named or by the columns' names.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/recording/csv.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/time.hpp"

namespace flexor::identify {

// One joint of the map: its sensors, the own one first, and the column of the measured angle.
struct JointMap {
  std::string joint;
  std::vector<std::string> sensors;
  std::string reference;

  bool operator==(const JointMap&) const = default;
};

// "thumb=SensorA0:thumb_deg,index=SensorA1+SensorA0:index_deg". Throws io::InputError, pointing at what is wrong.
std::vector<JointMap> parse_map(const std::string& text);

// To each joint's sensors those of the fingers beside it: the own ones of other joints, and columns with a finger's name.
std::vector<JointMap> with_neighbours(const std::vector<JointMap>& map,
                                      const std::vector<std::string>& columns);

// Of all joints, each once.
std::vector<std::string> sensors_of(const std::vector<JointMap>& map);

struct PairFiles {
  recording::Log sensor;
  recording::Log reference;
};

// Joints by name: each column of angles with the first sensor column whose name starts as its does, as index_deg and
// index_adc; else with that of its finger, as index_pip_deg and index_adc. Throws io::InputError listing the columns
// where nothing fits.
std::vector<JointMap> map_by_name(const PairFiles& files, const recording::TimeOptions& time);

// Of each: the last part of its path, with its folder where others end alike, or all of it.
std::vector<std::string> short_names(const std::vector<std::filesystem::path>& paths);

// Those of numbers; of a file with both, by their units. Throws io::InputError for a pipe, which can be read once only.
std::vector<std::string> columns_of(const PairFiles& files, bool are_angles,
                                    const recording::TimeOptions& time);

// Throws io::JobError below recording::kUnsure. `why`: what the map has to do with it.
void refuse_unsure(const std::string& source, double clock_offset_s, double confidence,
                   const std::string& why = "");

// Two logs and a column of each.
struct SourceFiles {
  recording::Log sensor;
  recording::Log reference;
  std::string input = {};            // column of the sensor file; empty: its only column of numbers
  std::string output = {};           // column of the reference file, an angle; likewise
  std::string output_unit = {};      // deg or rad, where that column states none; empty: degrees
  recording::TimeOptions time = {};  // s, ms, us or ns, of time columns that state none
};

// Throws io::InputError, listing the columns where one has to be named.
recording::Pair load_pair(SourceFiles files, bool clock_is_known = false);

// The same as a map of one joint: the finger that a column names, or else index. Throws as above.
struct OneJoint {
  JointMap map;
  bool is_named;  // by a column
};
OneJoint one_joint(SourceFiles files);

}  // namespace flexor::identify
