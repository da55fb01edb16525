// What a recording lacks for a compensator to be learnt from it, and what would supply it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/identify/additive.hpp"

namespace flexor::identify {

// A text for each of these that none of the sessions holds: range (20 degrees), a hold (a second
// within 2 degrees), quick motion (60 degrees a second, or the whole range in a second), slow motion (half a second between
// 3 and 30 degrees a second). Speeds are of the angle over a quarter of a second.
std::vector<std::string> lacking(const std::vector<Session>& sessions, double period_s);

// How many readings of these logs lie outside what the input takes; none: all are within.
std::optional<std::string> refused_readings(const model::Input& input,
                                            const std::vector<std::span<const double>>& logs);

}  // namespace flexor::identify
