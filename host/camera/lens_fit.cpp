#include <fmt/format.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "host/camera/lens.hpp"
#include "host/camera/opencv.hpp"
#include "host/camera/video.hpp"
#include "host/io/io.hpp"

namespace flexor::camera {
namespace {

constexpr std::size_t kLeastPictures = 5;
constexpr double kLargestRms_px = 2;

}  // namespace

Point Lens::undistort(Point p) const {
  if (distortion == std::array<double, 5>{}) return p;
  std::vector<cv::Point2d> point = {{p.x, p.y}};
  const cv::Matx33d k = matrix(*this);
  cv::undistortPoints(point, point, k, distortion, cv::noArray(), k);
  return {point.front().x, point.front().y};
}

namespace {

// The board's inner corners in each picture that shows them all; out.used and out.refused say which.
std::vector<std::vector<cv::Point2f>> find_corners(const std::vector<std::filesystem::path>& pictures,
                                                   const Board& board, cv::Size& picture_size, LensFit& out) {
  const cv::Size size(board.columns, board.rows);
  std::vector<std::vector<cv::Point2f>> seen;
  for (const std::filesystem::path& path : pictures) {
    const Picture picture = read_picture(path);
    const cv::Size s(picture.width, picture.height);
    if (picture_size.area() > 0 && s != picture_size) {
      throw io::InputError(
          fmt::format("{}: is {} x {} pixels, the pictures before it {} x {}: all must come from one "
                      "camera at one setting",
                      path.string(), s.width, s.height, picture_size.width, picture_size.height));
    }
    picture_size = s;
    cv::Mat grey;
    cv::cvtColor(mat(picture), grey, cv::COLOR_BGR2GRAY);
    std::vector<cv::Point2f> corners;
    constexpr int kLeast_px = 32;  // OpenCV fails on less
    if (std::min(s.width, s.height) < kLeast_px || !cv::findChessboardCorners(grey, size, corners)) {
      out.refused.push_back(fmt::format("{}: no board of {} x {} inner corners in sight", path.string(),
                                        board.columns, board.rows));
      continue;
    }
    constexpr int kHalfWindow = 7;
    cv::cornerSubPix(grey, corners, {kHalfWindow, kHalfWindow}, {-1, -1},
                     {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 0.001});
    seen.push_back(std::move(corners));
    out.used.push_back(path.string());
  }
  if (seen.size() < kLeastPictures) {
    throw io::InputError(fmt::format("{} of {} picture(s) show the whole board; at least {} are needed{}",
                                     seen.size(), pictures.size(), kLeastPictures,
                                     out.refused.empty() ? "" : " (" + out.refused.front() + ")"));
  }
  return seen;
}

}  // namespace

LensFit fit_lens(const std::vector<std::filesystem::path>& pictures, const Board& board) {
  if (board.columns < 3 || board.rows < 3) {
    throw io::InputError("a checkerboard needs at least 3 x 3 inner corners: count where four squares meet");
  }
  std::vector<cv::Point3f> square;
  for (int y = 0; y < board.rows; ++y) {
    for (int x = 0; x < board.columns; ++x)
      square.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.F);
  }
  LensFit out;
  cv::Size picture_size;
  const std::vector<std::vector<cv::Point2f>> seen = find_corners(pictures, board, picture_size, out);
  cv::Mat k;
  cv::Mat distortion;
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> shifts;
  const std::vector<std::vector<cv::Point3f>> boards(seen.size(), square);
  out.lens.reprojection_rms_px =
      cv::calibrateCamera(boards, seen, picture_size, k, distortion, turns, shifts);
  const bool sane = std::isfinite(out.lens.reprojection_rms_px) &&
                    out.lens.reprojection_rms_px < kLargestRms_px && cv::checkRange(k) &&
                    cv::checkRange(distortion);
  if (!sane) {
    throw io::JobError(
        fmt::format("the board's corners do not fit any lens (rms {:.1f} px): is the board flat, and do "
                    "the pictures show it tilted in different directions?",
                    out.lens.reprojection_rms_px));
  }
  out.lens.width = picture_size.width;
  out.lens.height = picture_size.height;
  out.lens.focal_px = {k.at<double>(0, 0), k.at<double>(1, 1)};
  out.lens.centre_px = {k.at<double>(0, 2), k.at<double>(1, 2)};
  for (int i = 0; i < static_cast<int>(out.lens.distortion.size()); ++i) {
    out.lens.distortion[static_cast<std::size_t>(i)] = distortion.at<double>(i);
  }
  out.lens.pictures = static_cast<int>(seen.size());
  return out;
}

}  // namespace flexor::camera
