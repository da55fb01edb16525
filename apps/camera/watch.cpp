#include "apps/camera/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "host/io/io.hpp"

namespace flexor::filming {

Watch::Watch(camera::Joints joints, std::optional<camera::Lens> lens)
    : joints_(std::move(joints)), lens_(std::move(lens)) {}

std::vector<camera::FilteredRow> Watch::push(const camera::Picture& picture, double t_s) {
  if (!(t_s >= 0 && t_s <= kMost_s && (!tracker_ || t_s >= last_s_ + kLeastStep_s))) {
    throw io::InputError(fmt::format(
        "picture: taken at {:.6f} s; times must lie between 0 and {:g} s and grow by a millisecond or more",
        t_s, kMost_s));
  }
  if (tracker_ && (picture.width != width_ || picture.height != height_)) {
    throw io::InputError(
        fmt::format("picture: {} x {} pixels, those before it {} x {}: begin anew to change the size",
                    picture.width, picture.height, width_, height_));
  }
  if (!tracker_) {
    tracker_.emplace(joints_, lens_, picture.width, picture.height);
    width_ = picture.width;
    height_ = picture.height;
  }
  last_s_ = t_s;
  return tracker_->push(picture, t_s);
}

std::optional<Watch::Taken> Watch::take(const std::string& device) {
  if (!video_) {
    video_ = std::make_unique<camera::VideoReader>(device);
    device_ = device;
    begin_ = std::chrono::steady_clock::now();
  }
  if (device != device_)
    throw io::InputError(fmt::format("{}: {} is watched already: begin anew", device, device_));
  Taken out;
  if (!video_->next(taken_, out.t_s)) return std::nullopt;
  if (!std::filesystem::is_character_file(device_))
    std::this_thread::sleep_until(begin_ + std::chrono::duration<double>(out.t_s));
  if (out.t_s >= last_s_ + kLeastStep_s) out.rows = push(taken_, out.t_s);
  return out;
}

std::vector<camera::FilteredRow> Watch::flush() {
  return tracker_ ? tracker_->flush() : std::vector<camera::FilteredRow>();
}

std::vector<std::array<double, 2>> Watch::marks_found() const {
  std::vector<std::array<double, 2>> found;
  if (!tracker_) return found;
  for (const camera::Observation& seen : tracker_->seen()) {
    for (const camera::ObservedMark& mark : seen.marks) {
      if (mark.measured) found.push_back({mark.at.x / width_, mark.at.y / height_});
    }
  }
  return found;
}

std::size_t Watch::marks() const {
  std::size_t all = 0;
  for (const camera::Skeleton& skeleton : joints_.skeletons) all += skeleton.marks.size();
  return all;
}

}  // namespace flexor::filming
