// Somebody else's compensator, adapted to a wearer by as little as can be.
#pragma once

#include <vector>

#include "host/identify/additive.hpp"
#include "host/model/channel.hpp"

namespace flexor::identify {

// `base` with the gain and the upper edge of the dead zone that lose least (pseudo-Huber, one degree wide) on these
// sessions of one sensor; poles and limits stay. Where its line is too steep for fixed point on readings that were
// never seen, those become invalid. Throws io::InputError for a channel without a dead zone.
model::Channel refit(const model::Channel& base, const std::vector<Session>& sessions, double period_s);

}  // namespace flexor::identify
