// Pictures with the time at which they were taken, from a file or a camera, and back into files.
//
// A frame's time is the container's, not its number times a nominal rate: rates vary and frames are
// dropped. Of a live camera it is the machine's clock when the picture arrived, from the first one on.
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "host/camera/picture.hpp"
#include "host/io/output.hpp"

namespace flexor::camera {

class VideoReader {
 public:
  // A file, or a camera device: /dev/video0. Throws io::InputError: missing, not a video, no picture in it,
  // a codec that this machine does not have.
  explicit VideoReader(const std::filesystem::path& path);

  // False at the end. The next picture takes the pixels of the one before, where that is given again. Times increase strictly: a
  // frame whose time does not is left out and counted. Throws io::JobError when the picture's size changes.
  bool next(Picture& picture, double& t_s);

  double nominal_rate_hz() const;  // 0: not known
  std::size_t frames() const { return frames_; }
  std::size_t declared_frames() const;  // as the container states; 0: it does not
  // Of all frames so far: cut off, no clock in the container, frames out of order.
  std::vector<std::string> warnings() const;

 private:
  double time_s();

  cv::VideoCapture capture_;
  Picture still_;  // of a file that is no video, but a picture
  std::string source_;
  std::string reason_;  // why OpenCV gave no picture; empty: it gave no reason
  bool live_ = false;
  bool no_clock_ = false;
  bool ended_ = false;
  double start_s_ = 0;
  double last_s_ = -1;
  double step_s_ = 0;
  std::size_t frames_ = 0;
  std::size_t read_ = 0;
  std::size_t out_of_order_ = 0;
  std::size_t without_time_ = 0;
  cv::Size size_;
};

// Where frames are missing: steps of more than one and a half times the median of the last 31.
class DropFinder {
 public:
  // Frames that are missing before this one.
  int add(double t_s);
  int dropped() const { return dropped_; }

 private:
  std::vector<double> steps_;
  double last_s_ = -1;
  int dropped_ = 0;
};

class VideoWriter {
 public:
  // .mp4 as H.264, which browsers play. By the rules and with the errors of
  // host/io/output.hpp; finish() counts the frames in the file. Left out, nothing is left behind.
  VideoWriter(const std::filesystem::path& path, int width, int height, double rate_hz);

  void add(const Picture& picture);
  void finish();

 private:
  std::filesystem::path path_;
  std::unique_ptr<io::Output> output_;
  cv::VideoWriter writer_;
  std::size_t frames_ = 0;
};

// PNG, JPEG, BMP, WebP or TIFF of at most 36 million pixels, 16 bits brought to 8. Throws io::InputError.
Picture read_picture(const std::filesystem::path& path);
// In one step; the format by the name. Throws io::InputError.
void write_picture(const std::filesystem::path& path, const Picture& picture);

}  // namespace flexor::camera
