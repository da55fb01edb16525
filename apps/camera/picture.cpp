#include "apps/camera/picture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "host/twin/random.hpp"

namespace flexor::filming {
namespace {

using camera::Point;

constexpr double kRadians = std::numbers::pi / 180;
const Bgr kSkin = {120, 150, 205};
constexpr std::array<double, 4> kRadius_mm = {11, 9, 8, 7};  // of a finger's links, from the hand on
constexpr double kMark_mm = 3.5;

Point along(Point from, double heading_deg, double length_mm) {
  return from + length_mm * Point(std::cos(heading_deg * kRadians), std::sin(heading_deg * kRadians));
}

cv::Point3d on_plane(Point p) { return {p.x, p.y, 0}; }

}  // namespace

void Chain::link(double length_mm, double turn_deg) {
  heading_deg_ += turn_deg;
  from_ = at_;
  at_ = along(from_, heading_deg_, length_mm);
  scene_.links.push_back({from_, at_, kRadius_mm.at(links_++), kSkin});
}

void Chain::mark() { scene_.marks.push_back({at_, at_, kMark_mm, paint_}); }

void Chain::marked_links(const std::vector<double>& length_mm, const std::vector<double>& turn_deg) {
  for (std::size_t k = 0; k < length_mm.size(); ++k) {
    link(length_mm[k], turn_deg[k]);
    mark();
  }
}

void Chain::print(Pattern pattern) {
  pattern.centre = (from_ + at_) / 2;
  pattern.turn_deg = heading_deg_;
  scene_.prints.push_back(std::move(pattern));
}

Renderer::Renderer(const View& view, const Look& look, std::uint64_t seed)
    : view_(view), look_(look), seed_(seed), canvas_(view.lens.height, view.lens.width, CV_32FC3) {
  cv::Matx33d tilt;
  cv::Rodrigues(cv::Vec3d(0, view.turn_deg * kRadians, 0), turn_);
  cv::Rodrigues(cv::Vec3d(view.tilt_deg * kRadians, 0, 0), tilt);
  turn_ = turn_ * tilt;
  std::vector<Point> at;
  for (int i = 0; i < canvas_.rows * canvas_.cols; ++i) at.emplace_back(i % canvas_.cols, i / canvas_.cols);
  cv::undistortPoints(at, at, view.lens.matrix(), view.lens.distortion, cv::noArray(), cv::noArray(),
                      {cv::TermCriteria::COUNT, 20, 0});
  // The plane's first two axes and its origin, as the camera has them.
  cv::Matx33d seen = turn_;
  for (int i = 0; i < 3; ++i) seen(i, 2) = i < 2 ? 0 : view.distance_mm;
  cv::perspectiveTransform(at, at, seen.inv());
  cv::Mat(at).reshape(2, canvas_.rows).convertTo(plane_, CV_32F);
  set_light(look.light);
  if (look.noise == 0) return;
  noise_.create(2 * canvas_.rows, 2 * canvas_.cols, CV_32FC3);
  cv::RNG(twin::seed_of(seed, 1)).fill(noise_, cv::RNG::NORMAL, 0, look.noise);
}

void Renderer::set_light(double light) {
  light_.create(canvas_.size(), CV_32FC3);
  for (int x = 0; x < canvas_.cols; ++x)
    light_.col(x) = cv::Scalar::all(light * (1 - look_.gradient * x / canvas_.cols));
}

// colour_at(p) of a point of the plane; null: the thing is not there.
template <class ColourAt>
void Renderer::paint(const std::vector<cv::Point3d>& outline, const ColourAt& colour_at) {
  // No two of a lattice's points share a row or a column: an edge along the pixels is drawn as exactly as any other.
  constexpr int kPoints = 16;
  constexpr int kLattice = 7;
  std::vector<Point> seen;
  cv::projectPoints(outline, turn_, cv::Vec3d(0, 0, view_.distance_mm), view_.lens.matrix(),
                    view_.lens.distortion, seen);
  cv::Rect box = cv::boundingRect(std::vector<cv::Point2f>(seen.begin(), seen.end()));
  box = (box + cv::Size(4, 4) - cv::Point(2, 2)) & cv::Rect({}, canvas_.size());
  if (box.empty()) return;
  touched_ |= box;
  for (int y = box.y; y < box.br().y; ++y) {
    for (int x = box.x; x < box.br().x; ++x) {
      // The plane is flat over one pixel.
      const int left = std::max(0, x - 1);
      const int above = std::max(0, y - 1);
      const auto at = plane_.at<cv::Vec2f>(y, x);
      const cv::Vec2f across = plane_.at<cv::Vec2f>(y, left + 1) - plane_.at<cv::Vec2f>(y, left);
      const cv::Vec2f down = plane_.at<cv::Vec2f>(above + 1, x) - plane_.at<cv::Vec2f>(above, x);
      int hits = 0;
      cv::Vec3f sum;
      for (int j = 0; j < kPoints; ++j) {
        const float u = (static_cast<float>(j) + 0.5F) / kPoints - 0.5F;
        const float v = (static_cast<float>(kLattice * j % kPoints) + 0.5F) / kPoints - 0.5F;
        const cv::Vec2f p = at + u * across + v * down;
        const Bgr* colour = colour_at(Point(cv::Point2f(p)));
        if (colour == nullptr) continue;
        ++hits;
        sum += cv::Vec3f(*colour);
      }
      auto& pixel = canvas_.at<cv::Vec3f>(y, x);
      pixel = (static_cast<float>(kPoints - hits) * pixel + sum) / kPoints;
    }
  }
}

void Renderer::paint(const Rod& rod) {
  std::vector<cv::Point3d> outline;
  for (const Point& end : {rod.a, rod.b}) {
    // A square around the circle, not in it.
    for (const double deg : {45, 135, 225, 315})
      outline.push_back(on_plane(along(end, deg, 1.5 * rod.radius_mm)));
  }
  const Point line = rod.b - rod.a;
  const double length2 = std::max(1e-12, line.dot(line));
  const double radius2 = rod.radius_mm * rod.radius_mm;
  paint(outline, [&](Point p) {
    const Point off = p - rod.a;
    const Point beside = off - std::clamp(off.dot(line) / length2, 0.0, 1.0) * line;
    return beside.dot(beside) <= radius2 ? &rod.colour : nullptr;
  });
}

void Renderer::paint(const Pattern& p) {
  const Point right = along({}, p.turn_deg, 1 / p.cell_mm);
  std::vector<cv::Point3d> outline;
  for (const double deg : {45, 135, 225, 315})
    outline.push_back(on_plane(along(p.centre, p.turn_deg + deg, p.cell_mm * std::max(p.columns, p.rows))));
  paint(outline, [&](Point at) {
    static const std::array<Bgr, 2> kInk = {Bgr(25, 25, 25), Bgr(235, 235, 235)};
    const Point off = at - p.centre;
    const int column = cvFloor(right.dot(off) + p.columns / 2.0);
    const int row = cvFloor(right.cross(off) + p.rows / 2.0);
    const bool inside = column >= 0 && row >= 0 && column < p.columns && row < p.rows;
    return inside ? &kInk[p.cells[row * p.columns + column]] : nullptr;
  });
}

const camera::Picture& Renderer::draw(const Scene& scene, std::uint64_t frame) {
  canvas_ = cv::Scalar(look_.background);
  touched_ = {};
  for (const Rod& rod : scene.links) paint(rod);
  for (const Pattern& print : scene.prints) paint(print);
  for (const Rod& rod : scene.marks) paint(rod);
  if (look_.blur_px > 0 && !touched_.empty()) {
    const int reach = cvCeil(3 * look_.blur_px);
    touched_ =
        (touched_ + cv::Size(2 * reach, 2 * reach) - cv::Point(reach, reach)) & cv::Rect({}, canvas_.size());
    cv::GaussianBlur(canvas_(touched_), canvas_(touched_), {}, look_.blur_px);
  }
  cv::multiply(canvas_, light_, canvas_);
  if (!noise_.empty()) {
    cv::RNG random(twin::seed_of(seed_, 2, frame));
    const cv::Point at(random.uniform(0, canvas_.cols), random.uniform(0, canvas_.rows));
    canvas_ += noise_(cv::Rect(at, canvas_.size()));
  }
  canvas_.convertTo(picture_, CV_8U);
  return picture_;
}

}  // namespace flexor::filming
