#include "host/camera/lens.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::camera {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUsualK1 = -0.1;
constexpr int kLargestSide_px = 65535;
constexpr double kLargest_px = 1e6;
constexpr double kLargestDistortion = 1000;
constexpr int kMostPictures = 1000000;

}  // namespace

void Lens::require_size(int w, int h, const std::string& source) const {
  if (w == width && h == height) return;
  throw io::InputError(fmt::format(
      "{}: the lens was calibrated at {} x {} pixels, this is {} x {}: calibrate with pictures of the "
      "same size",
      source, width, height, w, h));
}

Lens ordinary_lens(int width, int height) {
  constexpr double kFocalShare = 1.1;
  Lens out;
  out.width = width;
  out.height = height;
  out.focal_px = {kFocalShare * width, kFocalShare * width};
  out.centre_px = {(width - 1) / 2.0, (height - 1) / 2.0};
  return out;
}

namespace {

// Taking the distortion back is an iteration, which numbers that belong to no lens send to infinity.
void require_directions(const Lens& lens, const std::string& source) {
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Point at{static_cast<double>(lens.width) * i / kSteps,
                     static_cast<double>(lens.height) * j / kSteps};
      const Point p = lens.undistort(at);
      if (std::isfinite(p.x) && std::isfinite(p.y)) continue;
      throw io::InputError(fmt::format(
          "{}: the distortion has no answer at the picture's point ({:.0f}, {:.0f}): calibrate the lens anew",
          source, at.x, at.y));
    }
  }
}

}  // namespace

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

}  // namespace flexor::camera
