#include "apps/live/camera_feed.hpp"

#include <limits>
#include <utility>

#include "host/io/io.hpp"

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

CameraFeed::CameraFeed(std::string joints, bool drawn, std::function<void(PictureSeen)> seen,
                       std::function<void(std::string)> failed, std::function<void(std::string)> ended)
    : joints_(std::move(joints)),
      drawn_(drawn),
      seen_(std::move(seen)),
      failed_(std::move(failed)),
      ended_(std::move(ended)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

bool CameraFeed::is_busy() {
  const std::lock_guard lock(mutex_);
  return !waiting_.empty();
}

void CameraFeed::add(Work work) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMostWaiting) waiting_.pop_front();
    waiting_.push_back(std::move(work));
  }
  changed_.notify_one();
}

std::optional<CameraFeed::Work> CameraFeed::next(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait(lock, stop, [this] { return !waiting_.empty(); }) || stop.stop_requested()) return {};
  Work work = std::move(waiting_.front());
  waiting_.pop_front();
  return work;
}

void CameraFeed::run(const std::stop_token& stop) try {
  Camera camera;
  camera.open(joints_, {}, drawn_);
  for (std::uint64_t frame = 0;; ++frame) {
    std::optional<Work> work = next(stop);
    if (!work) return;
    try {
      if (work->mcp_deg) work->jpeg = camera.draw(*work->mcp_deg, frame);
      PictureSeen seen = with_names(camera.picture(work->t_s, work->jpeg), camera.angles());
      if (work->mcp_deg) seen.jpeg = std::move(work->jpeg);
      seen_(std::move(seen));
    } catch (const io::InputError& error) {  // this picture, and no other
      failed_(error.what());
    }
  }
} catch (const std::exception& error) {
  ended_(std::string("the camera: ") + error.what());
}

}  // namespace flexor::live
