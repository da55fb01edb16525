#include "apps/live/camera_feed.hpp"

#include <limits>
#include <utility>

#include "apps/live/beside.hpp"

namespace flexor::live {
namespace {

constexpr std::size_t kMostWaiting = 4;
constexpr double kUnsure_deg = 3;  // of a standard error: no reference

PictureSeen with_names(Seen seen, const std::vector<std::string>& names) {
  PictureSeen out{std::move(seen), {}, {}};
  for (const std::string& name : names) out.names.push_back(name.ends_with("_deg") ? name : name + "_deg");
  for (SeenRow& row : out.rows) {
    for (std::size_t i = 0; i < row.deg.size(); ++i) {  // made up from before and after, over too long a time
      if (row.quality[i] == kLost || row.se_deg[i] > kUnsure_deg)
        row.deg[i] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return out;
}

}  // namespace

void CameraFeed::add(Work work) {
  if (waiting_.size() >= kMostWaiting) waiting_.pop_front();
  waiting_.push_back(std::move(work));
  go_on();
}

void CameraFeed::go_on() {
  if (coming_.valid() || waiting_.empty()) return;
  coming_ = std::async(std::launch::async, [this, work = std::move(waiting_.front())] {
    PictureSeen seen = see(work);
    came_();
    return seen;
  });
  waiting_.pop_front();
}

std::optional<PictureSeen> CameraFeed::poll() {
  std::optional<PictureSeen> out = taken(coming_);
  go_on();
  return out;
}

PictureSeen CameraFeed::see(Work work) {
  if (!camera_) {
    auto camera = std::make_unique<Camera>();
    camera->open(joints_, {}, drawn_);
    camera_ = std::move(camera);
  }
  if (work.mcp_deg) work.jpeg = camera_->draw(*work.mcp_deg, frame_++);
  PictureSeen seen = with_names(camera_->picture(work.t_s, work.jpeg), camera_->angles());
  if (work.mcp_deg) seen.jpeg = std::move(work.jpeg);
  return seen;
}

}  // namespace flexor::live
