// Pictures for people: what was seen and measured, drawn over the video.
#pragma once

#include <deque>
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

// A video with what draw_seen draws, and below it a strip chart of the last ten seconds. Pictures wait until
// the filter has given their row, so that both show the same instant.
class Preview {
 public:
  Preview(const std::filesystem::path& path, int width, int height, double rate_hz, const Joints& joints);

  void add(const Picture& picture, const std::vector<Observation>& seen,
           const std::vector<FilteredRow>& rows);
  // `rows` of the pictures that still wait.
  void finish(const std::vector<FilteredRow>& rows);

 private:
  void write(const FilteredRow& row);

  Joints joints_;
  std::vector<std::string> names_;
  int width_;
  int height_;
  int chart_px_;
  VideoWriter writer_;
  std::deque<Picture> waiting_;
  std::deque<FilteredRow> past_;
};

}  // namespace flexor::camera
