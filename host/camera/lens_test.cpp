#include "host/camera/lens.hpp"

#include <gtest/gtest.h>

#include "host/io/expect_test.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"

namespace flexor::camera {
namespace {

Lens barrel() {
  Lens lens = ordinary_lens(1280, 720);
  lens.distortion = {-0.2, 0.05, 0.001, -0.0005, 0};
  return lens;
}

TEST(Lens, UndistortTakesBackWhatTheModelDoes) {
  const Lens lens = barrel();
  for (const Point ideal : {Point{640, 360}, Point{100, 80}, Point{1200, 700}, Point{900, 100}}) {
    const double x = (ideal.x - lens.centre_px.x) / lens.focal_px.x;
    const double y = (ideal.y - lens.centre_px.y) / lens.focal_px.y;
    const double r2 = x * x + y * y;
    const auto& [k1, k2, p1, p2, k3] = lens.distortion;
    const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
    const Point seen = {
        lens.focal_px.x * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + lens.centre_px.x,
        lens.focal_px.y * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + lens.centre_px.y};
    const Point back = lens.undistort(seen);
    EXPECT_NEAR(back.x, ideal.x, 0.02);
    EXPECT_NEAR(back.y, ideal.y, 0.02);
  }
}

TEST(Lens, FilesRoundTripAndBelongToOneSizeOfPicture) {
  EXPECT_EQ(to_json(lens_from_json(to_json(barrel()), "lens.json")), to_json(barrel()));
  EXPECT_THROW(barrel().require_size(640, 480, "x.mp4"), io::InputError);
  EXPECT_NO_THROW(barrel().require_size(1280, 720, "x.mp4"));
}

TEST(Lens, NumbersThatNoCameraHasAreNamed) {
  for (const auto& [field, value] : {std::pair{"width", "1e300"},
                                     {"height", "0"},
                                     {"pictures", "-1e300"},
                                     {"focal_px", "[1e300, 1]"},
                                     {"centre_px", "[0, -1e300]"},
                                     {"distortion", "[0, 0, 1e200, 0, 0]"},
                                     {"reprojection_rms_px", "-1"}}) {
    auto json = io::parse_json(to_json(barrel()), "");
    json[field] = io::parse_json(value, "");
    io::expect_refused([&] { (void)lens_from_json(io::dump(json), "lens.json"); },
                       std::string("lens.json: \"") + field + "\" is ");
  }
}

TEST(Lens, ADistortionThatNothingUndoesIsRefused) {
  Lens lens = ordinary_lens(1279, 719);
  lens.focal_px = {1408, 10};
  lens.centre_px = {0, 10};
  lens.distortion = {0, -1, 0, 1, 0};
  io::expect_refused([&] { (void)lens_from_json(to_json(lens), "lens.json"); },
                     "lens.json: the distortion has no answer at the picture's");
}

TEST(Lens, TheErrorAtTheEdgeGrowsWithTheBone) {
  EXPECT_GT(edge_error_deg(1280, 720, 100), 0.1);
  EXPECT_LT(edge_error_deg(1280, 720, 100), 2);
  EXPECT_NEAR(edge_error_deg(1280, 720, 200) / edge_error_deg(1280, 720, 100), 2, 0.2);
}

TEST(Lens, CalibrationRefusesTooFewOrUnreadablePictures) {
  EXPECT_THROW(fit_lens({}, {}), io::InputError);
  const io::TemporaryFolder folder;
  const auto path = folder.path() / "wall.png";
  io::write_file(path, "no picture");
  EXPECT_THROW(fit_lens({path}, {}), io::InputError);
  EXPECT_THROW(fit_lens({path}, {1, 1}), io::InputError);
}

}  // namespace
}  // namespace flexor::camera
