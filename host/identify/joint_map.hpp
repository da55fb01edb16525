// Which sensors and which measured angle belong to each joint.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/recording/log.hpp"
#include "host/recording/time.hpp"

namespace flexor::identify {

// One joint of the map: its sensors, the own one first, and the column of the measured angle.
struct JointMap {
  std::string joint;
  std::vector<std::string> sensors;
  std::string reference;
};

// "thumb=SensorA0:thumb_deg,index=SensorA1+SensorA0:index_deg". Throws io::InputError, pointing at what is wrong.
std::vector<JointMap> parse_map(const std::string& text);

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

}  // namespace flexor::identify
