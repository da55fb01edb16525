// Pictures for people: what was seen and measured, drawn over the video.
#pragma once

#include <vector>

#include "host/camera/mark_proposal.hpp"
#include "host/camera/tracker.hpp"

namespace flexor::camera {

// Candidates with numbers and proposed names.
Picture draw_proposal(const Picture& picture, const MarkProposal& proposal);

// Marks, bones and the angles of this frame.
Picture draw_seen(const Picture& picture, const Joints& joints, const std::vector<Observation>& seen);

}  // namespace flexor::camera
