// Pictures one after the other as somebody sends them, or as a camera gives them; rows of angles a few pictures later.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/camera/joints.hpp"
#include "host/camera/lens.hpp"
#include "host/camera/tracker.hpp"
#include "host/camera/video.hpp"

namespace flexor::filming {

class Watch {
 public:
  static constexpr double kLeastStep_s = 1e-3;
  static constexpr double kMost_s = 1e9;

  Watch(camera::Joints joints, std::optional<camera::Lens> lens);

  // One more picture, taken at t_s. Throws io::InputError, and the watch goes on: another size than the first
  // picture's, a time that is not a millisecond later than the last one's.
  std::vector<camera::FilteredRow> push(const camera::Picture& picture, double t_s);

  // The next picture of this camera, or of this video file at its own speed: what is late is not waited for. None at
  // the end. Throws as camera::VideoReader.
  struct Taken {
    double t_s = 0;
    std::vector<camera::FilteredRow> rows;
  };
  std::optional<Taken> take(const std::string& device);

  std::vector<camera::FilteredRow> flush();

  std::vector<std::string> angles() const { return camera::angle_names(joints_); }
  std::vector<std::array<double, 2>> marks_found()
      const;  // in the newest picture, as shares of its width and height
  std::size_t marks() const;
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  camera::Joints joints_;
  std::optional<camera::Lens> lens_;
  std::optional<camera::Tracker> tracker_;  // from the first picture on
  int width_ = 0;
  int height_ = 0;
  double last_s_ = -1;
  std::string device_;
  std::unique_ptr<camera::VideoReader> video_;
  std::chrono::steady_clock::time_point begin_;
  camera::Picture taken_;
};

}  // namespace flexor::filming
