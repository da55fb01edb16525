// Any bytes as a joint file and as a lens file: an InputError of one line, or a document that round-trips,
// whose angles and lens give something finite for every point of a picture.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "host/camera/angles.hpp"
#include "host/camera/joints.hpp"
#include "host/camera/lens.hpp"
#include "host/io/fuzz_json.hpp"

namespace {

using namespace flexor;
using io::fuzz::require;

void measure(const camera::Skeleton& s) {
  // On a spiral, so that no three marks lie on a line.
  std::vector<camera::Point> marks;
  for (std::size_t m = 0; m < s.marks.size(); ++m) {
    const double a = 0.7 * static_cast<double>(m);
    marks.push_back({300 + (20 + 9 * a) * std::cos(a), 200 + (20 + 9 * a) * std::sin(a)});
  }
  const std::vector<camera::Covariance> covariances(marks.size(), camera::Covariance{0.01, 0, 0.01});
  const double sign = camera::turn_sign(s.positive, marks);
  for (const camera::AngleRule& rule : s.angles) {
    require(rule.min_deg < rule.max_deg && std::isfinite(rule.max_deg - rule.min_deg));
    if (s.kind == camera::MarkKind::printed) continue;  // measured in space
    const auto angle = camera::measure_angle(rule, sign, marks, covariances);
    if (angle) require(std::abs(angle->deg) <= 720 && std::isfinite(angle->variance_deg2));
  }
}

void read_joints(const std::string& text) {
  const camera::Joints joints = camera::joints_from_json(text, io::fuzz::kSource);
  const std::string again = camera::to_json(joints);
  require(camera::to_json(camera::joints_from_json(again, "again")) == again);
  const camera::Picture picture(480, 640, CV_8UC3);
  for (const camera::Skeleton& s : joints.skeletons) {
    measure(s);
    for (const camera::Link& link : s.links)
      require(std::isfinite(std::log(link.length / s.length_tolerance)));
    for (const auto& start : s.start) require(!start || std::abs(start->x) + std::abs(start->y) < 1e7);
    const camera::Window window = camera::region_of(s, picture);
    require(window.x >= 0 && window.y >= 0 && window.width >= 0 && window.height >= 0);
    require(window.x + window.width <= picture.cols && window.y + window.height <= picture.rows);
    if (!s.colour) continue;
    for (const double weight : s.colour->weight) require(std::abs(weight * 255 * 64) < 1e6);
    const double sum = s.colour->level + s.colour->background + s.colour->area_px;
    require(std::abs(sum) < std::numeric_limits<int>::max() / 64);
  }
}

void read_lens(const std::string& text) {
  const camera::Lens lens = camera::lens_from_json(text, io::fuzz::kSource);
  const std::string again = camera::to_json(lens);
  require(camera::to_json(camera::lens_from_json(again, "again")) == again);
  require(lens.width > 0 && lens.height > 0 && lens.pictures >= 0 && lens.reprojection_rms_px >= 0);
  for (int x = 0; x <= 4; ++x) {
    for (int y = 0; y <= 4; ++y) {
      const camera::Point p = lens.undistort({lens.width * x / 4.0, lens.height * y / 4.0});
      require(std::isfinite(p.x) && std::isfinite(p.y));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  io::fuzz::read_or_refuse([&] { read_joints(text); });
  io::fuzz::read_or_refuse([&] { read_lens(text); });
  return 0;
}
