// A whole joint file through a whole video: pictures in, rows of angles out, a few frames later.
//
// Memory does not grow with the video: what is kept of the past is the filters' windows and the summary.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "host/camera/filter.hpp"
#include "host/camera/printed_tracker.hpp"
#include "host/camera/video.hpp"

namespace flexor::camera {

struct AngleSummary {
  std::string name;
  std::array<std::size_t, 4> frames{};  // of each quality
  double mean_se_deg = 0;               // of those that are not lost
  double min_deg = 0;
  double max_deg = 0;
};

struct Unsure {  // frames in a row in which some angle is not good
  double from_s = 0;
  double to_s = 0;
  std::size_t frames = 0;
  Quality quality = Quality::good;  // the worst of them
};

struct Summary {
  std::size_t frames = 0;
  std::size_t labelled = 0;  // every mark of every skeleton measured
  int dropped = 0;           // frames that are missing by the video's clock
  double from_s = 0;
  double to_s = 0;
  std::vector<AngleSummary> angles;
  std::vector<Unsure> unsure;  // the first kMaxUnsure
  std::size_t unsure_stretches = 0;
  std::vector<std::string> trouble;      // of skeletons that were never found
  std::size_t marks = 0;                 // of all skeletons together
  std::vector<std::string> never_found;  // those of them that no frame showed: "thumb: thumb_tip"
};

// Of all skeletons, in the order of the columns.
std::vector<std::string> angle_names(const Joints& joints);

class Tracker {
 public:
  static constexpr std::size_t kMaxUnsure = 200;

  // Without a lens, colour marks are taken as they are and printed ones as seen by an ordinary lens.
  Tracker(const Joints& joints, const std::optional<Lens>& lens, int width, int height);

  std::vector<FilteredRow> push(const Picture& picture, double t_s);
  std::vector<FilteredRow> flush();

  const std::vector<std::string>& angles() const { return names_; }
  const std::vector<Observation>& seen() const {
    return seen_;
  }  // of the newest picture, skeleton by skeleton
  Summary summary() const;

 private:
  void count(const FilteredRow& row);

  Joints joints_;
  std::vector<std::variant<ColourTracker, PrintedTracker>> trackers_;
  std::vector<std::vector<bool>> found_;  // by skeleton and mark: measured in some picture
  std::vector<std::string> names_;
  std::vector<Observation> seen_;
  AngleFilter filter_;
  DropFinder drops_;
  Summary summary_;
  bool unsure_now_ = false;
};

}  // namespace flexor::camera
