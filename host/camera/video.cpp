#include "host/camera/video.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <new>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include "host/io/numbers.hpp"

namespace flexor::camera {
namespace {

constexpr double kMost_s = 1e9;
constexpr double kMostPixels = 36e6;  // of a picture, and of a video's frame

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Errors are ours to report, in one line.
void be_silent() {
  [[maybe_unused]] static const bool done = [] {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    cv::redirectError([](int status, const char*, const char*, const char*, int, void*) {
      if (status == cv::Error::StsNoMem) throw std::bad_alloc();  // as everybody else reports it
      return 0;
    });
    setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // AV_LOG_QUIET
    // Pictures are read_picture()'s: FFmpeg decodes them while they are opened, and their metadata without a bound.
    setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS",
           "format_whitelist;mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,asf,dv,flv,gif,h264,hevc,ivf,jpeg_"
           "pipe,m4v,mjpeg,mpeg,mpegts,mpegvideo,mxf,nut,ogg,yuv4mpegpipe|codec_whitelist;h264,hevc,"
           "mpeg1video,mpeg2video,mpeg4,mjpeg,vp8,vp9,libvpx-vp9,libdav1d,av1,rawvideo,msmpeg4,msmpeg4v1,"
           "msmpeg4v2,wmv1,wmv2,wmv3,vc1,h263,flv,gif,theora,dvvideo,prores,ffv1,huffyuv,wrapped_avframe",
           1);
    return true;
  }();
}

void require_few_pixels(double pixels, const char* of, const std::string& source) {
  if (pixels <= kMostPixels) return;
  throw io::InputError("{}: {} of {:.4g} million pixels; at most {:.0f} million are taken", source, of,
                       pixels / 1e6, kMostPixels / 1e6);
}

// By the first bytes: OpenCV may have been built with readers of much else.
bool is_picture(std::string_view bytes) {
  using std::literals::operator""sv;
  static constexpr std::array kBegin = {"\x89PNG\r\n"sv, "\xff\xd8\xff"sv, "BM"sv,   "II*\0"sv, "MM\0*"sv,
                                        "P5 "sv,         "P6 "sv,          "P5\n"sv, "P6\n"sv};
  if (bytes.starts_with("RIFF")) return bytes.substr(8, 4) == "WEBP";
  return std::ranges::any_of(kBegin, [&](std::string_view begin) { return bytes.starts_with(begin); });
}

// OpenCV's message; memory that the process does not get is reported likewise.
std::string reason(const std::exception& error) {
  const auto* own = dynamic_cast<const cv::Exception*>(&error);
  if (own != nullptr) return ": " + io::one_line(own->err);
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr
             ? ": there is not enough memory for its pixels"
             : "";
}

// Packets of a video file, without decoding them.
std::size_t packets(const std::filesystem::path& path) {
  std::size_t count = 0;
  try {
    cv::VideoCapture capture(path.string(), cv::CAP_FFMPEG, {cv::CAP_PROP_FORMAT, -1});
    while (capture.grab()) ++count;
  } catch (const cv::Exception&) {
  }
  return count;
}

}  // namespace

VideoReader::VideoReader(const std::filesystem::path& path) : source_(path.string()) {
  be_silent();
  live_ = std::filesystem::is_character_file(path);
  if (!live_) {
    io::require_readable(path);
    if (std::filesystem::is_regular_file(path) && std::filesystem::file_size(path) == 0)
      throw io::InputError("{}: is empty", source_);
  }
  bool open = false;
  try {
    open = capture_.open(source_, live_ ? cv::CAP_V4L2 : cv::CAP_FFMPEG);
  } catch (const std::exception& error) {
    reason_ = reason(error);
  }
  if (!open && std::filesystem::is_regular_file(path)) {
    std::array<char, 12> begin{};
    std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
    if (is_picture({begin.data(), begin.size()})) still_ = read_picture(path);
  }
  if (!open && still_.empty()) {
    throw io::InputError(
        live_ ? fmt::format("{}: this camera cannot be opened{}: is it plugged in, free, and yours to read?",
                            source_, reason_)
              : fmt::format("{}: no video that can be read{}: is it one, is it whole, and is its codec "
                            "installed? MP4 with H.264 always works",
                            source_, reason_));
  }
  const auto codec = static_cast<std::uint32_t>(capture_.get(cv::CAP_PROP_FOURCC));
  constexpr std::uint32_t kCase = 0x20202020;
  if ((codec | kCase) == ('m' | 'p' << 8 | 'n' << 16 | 'g' << 24) ||
      (codec | kCase) == ('p' | 'n' << 8 | 'g' << 16 | ' ' << 24))
    throw io::InputError("{}: its frames are PNG pictures, which are not taken: MP4 with H.264 always works",
                         source_);
  const double pixels = capture_.get(cv::CAP_PROP_FRAME_WIDTH) * capture_.get(cv::CAP_PROP_FRAME_HEIGHT);
  require_few_pixels(pixels, "frames", source_);
}

double VideoReader::nominal_rate_hz() const {
  const double rate = capture_.get(cv::CAP_PROP_FPS);
  return std::isfinite(rate) && rate > 0 && rate < 1e5 ? rate : 0;
}

std::size_t VideoReader::declared_frames() const {
  const double n = live_ ? 0 : capture_.get(cv::CAP_PROP_FRAME_COUNT);
  return std::isfinite(n) && n > 0 && n < 1e9 ? static_cast<std::size_t>(n) : 0;
}

double VideoReader::time_s() {
  if (live_) {
    if (read_ == 1) start_s_ = now_s();
    return now_s() - start_s_;
  }
  const double t = capture_.get(cv::CAP_PROP_POS_MSEC) / 1000;
  // Streams without a container give 0 for ever, or FFmpeg's mark for "no time", the least 64-bit number.
  if (t < -kMost_s || (read_ == 2 && t == last_s_)) no_clock_ = true;
  const double rate = nominal_rate_hz() > 0 ? nominal_rate_hz() : 25;
  return no_clock_ ? static_cast<double>(read_ - 1) / rate : t;
}

bool VideoReader::next(Picture& picture, double& t_s) {
  while (!ended_) {
    bool got = false;
    try {
      const bool still = frames_ == 0 && !still_.empty();
      if (still) picture = std::move(still_);
      got = still || (capture_.read(picture) && !picture.empty());
    } catch (const std::exception& error) {
      reason_ = reason(error);
    }
    if (!got) {
      ended_ = true;
      break;
    }
    if (picture.type() != CV_8UC3) throw io::JobError("{}: its pictures have no colours", source_);
    if (frames_ == 0) size_ = picture.size();
    if (picture.size() != size_)
      throw io::JobError("{}: frame {} is {} x {} pixels, those before it {} x {}", source_, read_ + 1,
                         picture.cols, picture.rows, size_.width, size_.height);
    ++read_;
    double t = time_s();
    // OpenCV forgets the time of frames that a decoder had kept back until the end of the file.
    if (!live_ && t == 0 && frames_ > 1) {
      t = last_s_ + step_s_;
      ++without_time_;
    }
    if (!std::isfinite(t) || (frames_ > 0 && t <= last_s_)) {
      ++out_of_order_;
      continue;
    }
    step_s_ = t - last_s_;
    last_s_ = t_s = t;
    ++frames_;
    return true;
  }
  if (frames_ == 0) throw io::InputError("{}: holds no picture that can be decoded{}", source_, reason_);
  return false;
}

std::vector<std::string> VideoReader::warnings() const {
  std::vector<std::string> out;
  if (no_clock_) out.push_back(fmt::format("{}: has no clock of its own; the nominal rate is used", source_));
  if (without_time_ > 0) {
    out.push_back(fmt::format(
        "{}: the last {} frame(s) come without a time; each is taken one step after the one before", source_,
        without_time_));
  }
  if (out_of_order_ > 0) {
    out.push_back(
        fmt::format("{}: {} frame(s) whose time does not increase are left out", source_, out_of_order_));
  }
  if (ended_ && read_ + 1 < declared_frames()) {
    out.push_back(fmt::format("{}: ends early, after {} of {} frames: the file is cut off or damaged{}",
                              source_, read_, declared_frames(), reason_));
  }
  return out;
}

int DropFinder::add(double t_s) {
  constexpr std::size_t kSteps = 31;
  const double step = t_s - last_s_;
  const bool first = last_s_ < 0;
  last_s_ = t_s;
  if (first) return 0;
  int missing = 0;
  if (steps_.size() >= 3) {
    const double usual = io::median(steps_);
    if (step > 1.5 * usual) missing = static_cast<int>(std::lround(step / usual)) - 1;
  }
  steps_.push_back(step);
  if (steps_.size() > kSteps) steps_.erase(steps_.begin());
  dropped_ += missing;
  return missing;
}

VideoWriter::VideoWriter(const std::filesystem::path& path, int width, int height, double rate_hz)
    : path_(path) {
  be_silent();
  if (path.extension() != ".mp4") throw io::InputError("{}: a video's name must end in .mp4", path.string());
  io::require_file(path);
  output_ = std::make_unique<io::Output>(path);
  bool open = false;
  try {
    open = writer_.open(output_->name().string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('a', 'v', 'c', '1'),
                        rate_hz, {width + width % 2, height + height % 2});
  } catch (const cv::Exception&) {
  }
  if (!open) {
    output_->require_room();
    throw io::InputError(
        "{}: cannot be written as a video of {} x {} pixels: is the codec installed, and is "
        "there memory for pictures of this size?",
        path.string(), width, height);
  }
}

void VideoWriter::add(const Picture& picture) {
  Picture page;  // of even sides, as H.264 wants them
  cv::copyMakeBorder(picture, page, 0, picture.rows % 2, 0, picture.cols % 2, cv::BORDER_CONSTANT);
  writer_.write(page);
  ++frames_;
}

// FFmpeg does not report what the disk refused, such as the index at the end, but a disk that did has no room for more.
void VideoWriter::finish() {
  writer_.release();
  const std::filesystem::path& name = output_->name();
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(name, ignored);
  output_->require_room();
  std::filesystem::resize_file(name, size, ignored);
  if (const std::size_t n = packets(name); n != frames_)
    throw io::JobError("{}: cannot be written: holds {} of {} frames", path_.string(), n, frames_);
  output_->commit();
}

Picture read_picture(const std::filesystem::path& path) {
  be_silent();
  const std::string bytes = io::read_file(path);
  Picture picture;
  std::string why;
  try {
    if (is_picture(bytes))
      picture =
          cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
                       cv::IMREAD_COLOR);
  } catch (const std::exception& error) {
    why = reason(error);
  }
  if (picture.empty())
    throw io::InputError(
        "{}: no picture that can be read{}: is it a PNG or a JPEG, of at most {:.0f} million pixels?",
        path.string(), why, kMostPixels / 1e6);
  require_few_pixels(static_cast<double>(picture.total()), "a picture", path.string());
  return picture;
}

void write_picture(const std::filesystem::path& path, const Picture& picture) {
  be_silent();
  std::vector<std::uint8_t> bytes;
  bool good = false;
  try {
    good = cv::imencode(path.extension().string(), picture, bytes);
  } catch (const cv::Exception&) {
  }
  if (!good) throw io::InputError("{}: a picture's name must end in .png or .jpg", path.string());
  io::write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace flexor::camera
