// Whether map and recordings belong together, before anything is fitted; what a recording lacks for a compensator to be learnt
// from it, and what would supply it.
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "host/identify/identify.hpp"

namespace flexor::identify {

// Warns of sensors that say the same, of one that is stuck while its angle moves, and where another sensor of the log tells a joint
// better than the one that the map names. Throws io::JobError where none tells it at all. Looks at the whole recording: it only
// warns and refuses. The joints whose sensor is stuck: no structure mends that.
std::set<std::string> check_map(const Options& options, const Take& take, double clock_offset_s,
                                std::vector<std::string>& warnings);

// Throws io::InputError where the last log is that of an earlier pair: nothing would differ between these donnings.
void refuse_seen_before(const std::vector<Take>& takes);
// Or where a sensor of it states another unit than the first pair's does, or reads far from it and 2.5 times as much.
void refuse_other_units(const std::vector<Take>& takes);

// A session for each take, and its name: throws io::InputError where one's sensor moves the other way, or 2.5 times as far.
void check_gloves(const JointMap& map, const std::vector<std::string>& names,
                  const std::vector<Session>& sessions);

// None where the column's unit is the input's; where either states none, a line that says so. A reading in another unit would
// give angles that look right: throws io::InputError.
std::optional<std::string> unit_note(const model::Input& input, const std::string& file,
                                     const std::string& column, const std::string& unit);

// What of a joint's signals tells nothing: a sensor or an angle that stands at
// an extreme while the other goes on.
std::vector<std::string> one_sided(const JointMap& map, const std::vector<Session>& sessions);

// A text for each of these that none of the sessions holds: range (20 degrees), a hold (a second
// within 2 degrees), quick motion (60 degrees a second, or the whole range in a second), slow motion (half a second between
// 3 and 30 degrees a second). Speeds are of the angle over a quarter of a second.
std::vector<std::string> lacking(const std::vector<Session>& sessions, double period_s);

// How many readings of these logs lie outside what the input takes; none: all are within.
std::optional<std::string> refused_readings(const model::Input& input,
                                            const std::vector<std::span<const double>>& logs);

}  // namespace flexor::identify
