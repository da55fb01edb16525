// What the fitted part of a recording lacks for a compensator to be learnt from it, and the motion that would supply it.
#pragma once

#include <string>
#include <vector>

#include "host/identify/additive.hpp"

namespace flexor::identify {

// A text for each of these that none of the sessions holds: range (20 degrees), a hold (a second
// within 2 degrees), quick motion (60 degrees a second, or the whole range in a second), slow motion (half a second between
// 3 and 30 degrees a second). Speeds are of the angle over a quarter of a second.
std::vector<std::string> lacking(const std::vector<Session>& sessions, double period_s);

}  // namespace flexor::identify
