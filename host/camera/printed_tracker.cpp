#include "host/camera/printed_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace flexor::camera {
namespace {

constexpr double kLeastSigma_px = 0.025;  // no edge is known better, however straight it looks
constexpr double kOddNormal = 0.9;        // cosine: links whose marks face different ways are doubtful

struct Pose {
  cv::Matx33d turn;
  double error_px = 0;
  cv::Vec3d normal() const { return {turn(0, 2), turn(1, 2), turn(2, 2)}; }
};

struct Found {
  std::vector<cv::Point2f> corners;
  std::vector<Pose> poses;  // one or two
  std::size_t chosen = 0;
  double side_px = 0;
  double corner_variance_px2 = 0;
};

double brightness(const cv::Mat& grey, double x, double y) {
  const int left = std::clamp(static_cast<int>(std::floor(x)), 0, grey.cols - 2);
  const int top = std::clamp(static_cast<int>(std::floor(y)), 0, grey.rows - 2);
  const double u = std::clamp(x - left, 0.0, 1.0);
  const double v = std::clamp(y - top, 0.0, 1.0);
  const auto* upper = grey.ptr<std::uint8_t>(top);
  const auto* lower = grey.ptr<std::uint8_t>(top + 1);
  return (1 - v) * ((1 - u) * upper[left] + u * upper[left + 1]) +
         v * ((1 - u) * lower[left] + u * lower[left + 1]);
}

// A straight edge: normal . p = offset.
struct Edge {
  cv::Vec2d normal;
  double offset = 0;
  double variance_px2 = 0;  // of its ends across the edge
};

// The edge from a to b, black on the right-hand side of the way: at places along its middle 80 % the centre
// of gravity of the slope of brightness across it, which blur and pixels do not move, and a line through
// them.
std::optional<Edge> find_edge(const cv::Mat& grey, const cv::Vec2d& a, const cv::Vec2d& b, bool rough) {
  const cv::Vec2d along = b - a;
  const double length = cv::norm(along);
  const cv::Vec2d step = along / length;
  const cv::Vec2d out(step[1], -step[0]);
  constexpr double kStep_px = 0.5;
  const int steps = rough ? 6 : 4;       // to either side: 3 or 2 pixels
  constexpr double kLeastContrast = 20;  // grey levels, summed over the steps
  std::vector<cv::Vec2d> points;
  const int places = static_cast<int>(0.8 * length) + 1;
  for (int i = 0; i < places; ++i) {
    const cv::Vec2d middle = a + (0.1 * length + i) * step;
    double weight = 0;
    double place = 0;
    for (int k = -steps; k <= steps; ++k) {
      const double d = k * kStep_px;
      const cv::Vec2d p = middle + d * out;
      const double slope = brightness(grey, p[0] + out[0] / 2, p[1] + out[1] / 2) -
                           brightness(grey, p[0] - out[0] / 2, p[1] - out[1] / 2);
      // At first the strongest slope, wherever it is; from there all of it.
      const double w = rough ? std::max(0.0, slope) * slope : slope;
      weight += w;
      place += w * d;
    }
    if (weight > kLeastContrast) points.push_back(middle + place / weight * out);
  }
  constexpr std::size_t kLeastPoints = 6;
  if (points.size() < kLeastPoints) return std::nullopt;
  const auto n = static_cast<double>(points.size());
  const cv::PCA line(cv::Mat(points).reshape(1), cv::noArray(), cv::PCA::DATA_AS_ROW);
  Edge edge;
  edge.normal = line.eigenvectors.row(1);
  edge.offset = edge.normal.dot(cv::Vec2d(line.mean));
  // A fitted line is uncertain by 2 sigma / sqrt(n) at its ends; every pixel counts in two of the places.
  constexpr double kShared = 2;
  edge.variance_px2 = kShared * 4 * line.eigenvalues.at<double>(1) / (n - 2);
  return edge;
}

// Corners as crossings of the four edges; their mean variance. nullopt: some edge is not to be seen.
std::optional<double> refine(const cv::Mat& grey, std::vector<cv::Point2f>& corners, bool rough) {
  std::array<Edge, 4> edge;
  double variance = 0;
  const auto corner = [&](std::size_t i) { return cv::Vec2d(corners[i % 4].x, corners[i % 4].y); };
  for (std::size_t i = 0; i < 4; ++i) {
    const auto found = find_edge(grey, corner(i), corner(i + 1), rough);
    if (!found) return std::nullopt;
    edge[i] = *found;
    variance += found->variance_px2 / 4;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const Edge& before = edge[(i + 3) % 4];
    const Edge& after = edge[i];
    const cv::Matx22d normals(before.normal[0], before.normal[1], after.normal[0], after.normal[1]);
    if (std::abs(cv::determinant(normals)) < 0.3) return std::nullopt;
    const cv::Matx21d at = normals.solve(cv::Vec2d(before.offset, after.offset));
    corners[i] = Point(at(0), at(1));
  }
  return variance;
}

// Of a square's turn about its normal.
double turn_variance_deg2(const Found& f) {
  const double variance = std::max(kLeastSigma_px * kLeastSigma_px, f.corner_variance_px2);
  return kDegrees * kDegrees * variance / (2 * f.side_px * f.side_px);
}

// The choice of poses whose normals agree best with one of them.
void choose(std::vector<std::optional<Found>>& found) {
  double best = -1e9;
  std::vector<std::size_t> choice(found.size());
  for (const auto& reference : found) {
    if (!reference) continue;
    for (const Pose& r : reference->poses) {
      const auto value = [&](const Pose& pose) {
        return pose.normal().dot(r.normal()) - 0.2 * pose.error_px;
      };
      double agreement = -r.error_px;
      std::vector<std::size_t> taken(found.size());
      for (std::size_t m = 0; m < found.size(); ++m) {
        if (!found[m]) continue;
        const std::vector<Pose>& poses = found[m]->poses;
        const auto closest = std::ranges::max_element(poses, {}, value);
        taken[m] = static_cast<std::size_t>(closest - poses.begin());
        agreement += value(*closest);
      }
      if (agreement <= best) continue;
      best = agreement;
      choice = taken;
    }
  }
  for (std::size_t m = 0; m < found.size(); ++m) {
    if (found[m]) found[m]->chosen = choice[m];
  }
}

std::vector<std::optional<Found>> detect(const Skeleton& skeleton, const Lens& lens, const Picture& picture) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11), corners,
                           ids);
  const auto half = static_cast<float>(skeleton.size_mm / 2);
  const std::vector<cv::Point3f> square = {
      {-half, half, 0}, {half, half, 0}, {half, -half, 0}, {-half, -half, 0}};
  std::vector<std::optional<Found>> found(skeleton.marks.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto it = std::ranges::find(skeleton.ids, ids[i]);
    if (it == skeleton.ids.end()) continue;
    Found f;
    f.corners = corners[i];
    if (!refine(grey, f.corners, true)) continue;
    const auto variance = refine(grey, f.corners, false);
    if (!variance) continue;
    f.corner_variance_px2 = *variance;
    f.side_px = std::sqrt(cv::contourArea(f.corners));
    std::vector<cv::Vec3d> turns;
    std::vector<cv::Vec3d> shifts;
    std::vector<double> errors;
    cv::solvePnPGeneric(square, f.corners, lens.matrix(), lens.distortion, turns, shifts, false,
                        cv::SOLVEPNP_IPPE_SQUARE, cv::noArray(), cv::noArray(), errors);
    for (std::size_t p = 0; p < turns.size(); ++p) {
      Pose& pose = f.poses.emplace_back();
      cv::Rodrigues(turns[p], pose.turn);
      pose.error_px = errors[p];
    }
    if (f.poses.empty()) continue;
    auto& place = found[static_cast<std::size_t>(it - skeleton.ids.begin())];
    // The same number twice: neither can be trusted.
    if (place) {
      place.reset();
      continue;
    }
    place = std::move(f);
  }
  return found;
}

std::vector<Measurement> measure(const Skeleton& skeleton, const std::vector<std::optional<Found>>& found) {
  std::vector<Measurement> out;
  for (const AngleRule& rule : skeleton.angles) {
    Measurement m;
    const auto& a = found[rule.marks[0]];
    const auto& b = found[rule.marks[1]];
    if (a && b) {
      const Pose& pa = a->poses[a->chosen];
      const Pose& pb = b->poses[b->chosen];
      const cv::Matx33d r = pa.turn.t() * pb.turn;
      const double turn = std::atan2(r(1, 0) - r(0, 1), r(0, 0) + r(1, 1)) * kDegrees;
      Angle angle;
      // The square's y axis points up, the picture's down: clockwise on the screen is a negative turn.
      angle.deg = (rule.negative ? turn : -turn) + rule.offset_deg;
      angle.variance_deg2 = turn_variance_deg2(*a) + turn_variance_deg2(*b);
      m.angle = angle;
      m.doubtful =
          angle.deg < rule.min_deg || angle.deg > rule.max_deg || pa.normal().dot(pb.normal()) < kOddNormal;
    }
    out.push_back(m);
  }
  return out;
}

}  // namespace

Observation PrintedTracker::step(const Picture& picture, double) {
  std::vector<std::optional<Found>> found = detect(skeleton_, lens_, picture);
  choose(found);
  Observation out;
  for (const auto& f : found) {
    ObservedMark mark;
    if (f) {
      const cv::Scalar middle = cv::mean(f->corners);
      mark.at = {middle[0], middle[1]};
      mark.area_px = f->side_px * f->side_px;
      mark.measured = true;
      mark.lost = false;
    }
    out.marks.push_back(mark);
  }
  out.measurements = measure(skeleton_, found);
  const bool any = std::ranges::any_of(out.marks, &ObservedMark::measured);
  trouble_ = any ? "" : "none of the printed marks is in sight";
  return out;
}

}  // namespace flexor::camera
