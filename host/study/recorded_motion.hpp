// Recorded motion of a hand, as wide CSV or as text of GraspDB, as a motion of the twin's.
//
// Both pause at most a minute and last 0.01 s to an hour. Errors are io::InputError, one line naming the
// source, the row and the mend.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/twin/motion.hpp"

namespace flexor::study {

// Columns thumb_deg index_deg middle_deg ring_deg pinky_deg, on the hand's own scale, 0 to 180 degrees.
// `notes` gets what was repaired, a line each. The motion is called by the source's stem. Both likewise below.
twin::Motion csv_motion(const std::string& text, const std::filesystem::path& source,
                        std::vector<std::string>& notes);

// GraspDB: year month day hour minute second flag, then 23 joints in radians, flexion negative; MCP of thumb,
// index, middle, ring and little finger are joints 2, 5, 9, 13 and 17.
twin::Motion grasp_motion(const std::string& text, const std::filesystem::path& source,
                          std::vector<std::string>& notes);

}  // namespace flexor::study
