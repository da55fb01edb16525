#include "host/camera/lens.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "host/camera/video.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::camera {
namespace {

constexpr double kUsualK1 = -0.1;
constexpr int kLargestSide_px = 65535;
constexpr double kLargest_px = 1e6;
constexpr double kLargestDistortion = 1000;
constexpr int kMostPictures = 1000000;
constexpr std::size_t kLeastPictures = 5;
constexpr double kLargestRms_px = 2;

// Taking the distortion back is an iteration, which numbers that belong to no lens send to infinity.
void require_directions(const Lens& lens, const std::string& source) {
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Point at{static_cast<double>(lens.width) * i / kSteps,
                     static_cast<double>(lens.height) * j / kSteps};
      const Point p = lens.undistort(at);
      if (std::isfinite(p.x) && std::isfinite(p.y)) continue;
      throw io::InputError(
          "{}: the distortion has no answer at the picture's point ({:.0f}, {:.0f}): calibrate it again",
          source, at.x, at.y);
    }
  }
}

// The board's inner corners in each picture that shows them all; out.used and out.refused list which.
std::vector<std::vector<cv::Point2f>> find_corners(const std::vector<std::filesystem::path>& pictures,
                                                   const Board& board, cv::Size& picture_size, LensFit& out) {
  const cv::Size size(board.columns, board.rows);
  std::vector<std::vector<cv::Point2f>> seen;
  for (const std::filesystem::path& path : pictures) {
    const Picture picture = read_picture(path);
    const cv::Size s = picture.size();
    if (picture_size.area() > 0 && s != picture_size) {
      throw io::InputError(
          "{}: is {} x {} pixels, the pictures before it {} x {}: all must come from one "
          "camera at one setting",
          path.string(), s.width, s.height, picture_size.width, picture_size.height);
    }
    picture_size = s;
    cv::Mat grey;
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
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
    throw io::InputError("{} of {} picture(s) show the whole board; at least {} are needed{}", seen.size(),
                         pictures.size(), kLeastPictures,
                         out.refused.empty() ? "" : " (" + out.refused.front() + ")");
  }
  return seen;
}

}  // namespace

void Lens::require_size(int w, int h, const std::string& source) const {
  if (w == width && h == height) return;
  throw io::InputError(
      "{}: the lens was calibrated at {} x {} pixels, this is {} x {}: calibrate with pictures of the "
      "same size",
      source, width, height, w, h);
}

Lens ordinary_lens(int width, int height) {
  constexpr double kFocalShare = 1.1;
  return {.width = width,
          .height = height,
          .focal_px = {kFocalShare * width, kFocalShare * width},
          .centre_px = {(width - 1) / 2.0, (height - 1) / 2.0}};
}

Lens lens_from_json(const std::string& text, const std::string& source) {
  const Json json = io::parse_json(text, source);
  io::JsonReader reader(json, source);
  reader.schema("flexor-lens", 1);
  Lens out;
  out.width = reader.whole_within("width", 1, kLargestSide_px);
  out.height = reader.whole_within("height", 1, kLargestSide_px);
  const auto pair = [&](const char* key, double low_px) {
    const std::vector<double> v = reader.numbers_within(key, low_px, kLargest_px);
    if (v.size() != 2) reader.fail(fmt::format("\"{}\" must be two numbers", key));
    return Point{v[0], v[1]};
  };
  out.focal_px = pair("focal_px", 1);
  out.centre_px = pair("centre_px", -kLargest_px);
  const std::vector<double> distortion =
      reader.numbers_within("distortion", -kLargestDistortion, kLargestDistortion);
  if (distortion.size() != out.distortion.size()) reader.fail("\"distortion\" must be k1, k2, p1, p2, k3");
  std::ranges::copy(distortion, out.distortion.begin());
  out.reprojection_rms_px = reader.number_within("reprojection_rms_px", 0, kLargest_px);
  out.pictures = reader.whole_within("pictures", 0, kMostPictures);
  reader.done();
  require_directions(out, source);
  return out;
}

Lens load_lens(const std::filesystem::path& path) {
  return lens_from_json(io::read_document(path), path.string());
}

std::string to_json(const Lens& lens) {
  const Json json = {{"schema", "flexor-lens"},
                     {"schema_version", 1},
                     {"width", lens.width},
                     {"height", lens.height},
                     {"focal_px", {lens.focal_px.x, lens.focal_px.y}},
                     {"centre_px", {lens.centre_px.x, lens.centre_px.y}},
                     {"distortion", lens.distortion},
                     {"reprojection_rms_px", lens.reprojection_rms_px},
                     {"pictures", lens.pictures}};
  return io::dump(json);
}

double edge_error_deg(int width, int height, double bone_px) {
  const Lens lens = ordinary_lens(width, height);
  // Along the picture's diagonal nothing bends; across it most.
  const auto bent = [&](double along, double across) {
    const double half = std::hypot(width, height) / 2;
    const double x = (half - along) / lens.focal_px.x;
    const double y = across / lens.focal_px.x;
    const double stretch = 1 + kUsualK1 * (x * x + y * y);
    return Point{x * stretch, y * stretch};
  };
  const Point a = bent(0, -bone_px);
  const Point b = bent(0, 0);
  const Point c = bent(0, bone_px);
  const double turn = std::atan2(c.y - b.y, c.x - b.x) - std::atan2(b.y - a.y, b.x - a.x);
  return std::abs(turn) * 180 / std::numbers::pi;
}

Point Lens::undistort(Point p) const {
  if (distortion == std::array<double, 5>{}) return p;
  std::vector<Point> point = {p};
  const cv::Matx33d k = matrix();
  cv::undistortPoints(point, point, k, distortion, cv::noArray(), k);
  return point.front();
}

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
  const std::vector<std::vector<cv::Point3f>> boards(seen.size(), square);
  out.lens.reprojection_rms_px =
      cv::calibrateCamera(boards, seen, picture_size, k, distortion, cv::noArray(), cv::noArray());
  const bool sane = std::isfinite(out.lens.reprojection_rms_px) &&
                    out.lens.reprojection_rms_px < kLargestRms_px && cv::checkRange(k) &&
                    cv::checkRange(distortion);
  if (!sane) {
    throw io::JobError(
        "the board's corners do not fit any lens (rms {:.1f} px): is the board flat, and do "
        "the pictures show it tilted in different directions?",
        out.lens.reprojection_rms_px);
  }
  out.lens.width = picture_size.width;
  out.lens.height = picture_size.height;
  out.lens.focal_px = {k.at<double>(0, 0), k.at<double>(1, 1)};
  out.lens.centre_px = {k.at<double>(0, 2), k.at<double>(1, 2)};
  std::copy_n(distortion.begin<double>(), out.lens.distortion.size(), out.lens.distortion.begin());
  out.lens.pictures = static_cast<int>(seen.size());
  return out;
}

}  // namespace flexor::camera
