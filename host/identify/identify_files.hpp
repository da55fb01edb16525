// Two logs and a column of each, named or the only one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/identify/joint_map.hpp"
#include "host/recording/pair.hpp"
#include "host/recording/time.hpp"

namespace flexor::identify {

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
