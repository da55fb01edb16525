// Pictures for people: what was seen and measured, drawn over the video.
#pragma once

#include <filesystem>
#include <vector>

#include "host/camera/mark_proposal.hpp"
#include "host/camera/tracker.hpp"
#include "host/camera/video.hpp"

namespace flexor::camera {

// Candidates with numbers and proposed names.
Picture draw_proposal(const Picture& picture, const MarkProposal& proposal);

// Marks, bones and the angles of this frame.
Picture draw_seen(const Picture& picture, const Joints& joints, const std::vector<Observation>& seen);

// A video with what draw_seen draws.
class Preview {
 public:
  Preview(const std::filesystem::path& path, int width, int height, double rate_hz, const Joints& joints);

  void add(const Picture& picture, const std::vector<Observation>& seen);
  void finish() { writer_.finish(); }

 private:
  Joints joints_;
  Picture page_;  // of even sides, as H.264 wants them
  VideoWriter writer_;
};

}  // namespace flexor::camera
