#include "host/camera/lens.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "host/camera/test_pictures.hpp"
#include "host/io/io.hpp"
#include "host/io/json.hpp"
#include "host/io/refusal_test.hpp"

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

TEST(Lens, FilesRoundTripAndMistakesAreNamed) {
  const auto path = scratch("lens.json");
  io::write_file(path, to_json(barrel()));
  EXPECT_EQ(to_json(load_lens(path)), to_json(barrel()));
  std::string text = to_json(barrel());
  text.replace(text.find("flexor-lens"), 11, "flexor-hens");
  io::write_file(path, text);
  EXPECT_THROW(load_lens(path), io::InputError);
  std::filesystem::remove(path);
  EXPECT_THROW(barrel().require_size(640, 480, "x.mp4"), io::InputError);
  EXPECT_NO_THROW(barrel().require_size(1280, 720, "x.mp4"));
}

TEST(Lens, NumbersThatNoCameraHasAreNamed) {
  const auto refusal = [](const char* field, const std::string& value) -> std::string {
    auto json = io::parse_json(to_json(barrel()), "");
    json[field] = io::parse_json(value, "");
    return io::refusal_of([&] { (void)lens_from_json(io::dump(json), "lens.json"); });
  };
  EXPECT_EQ(refusal("width", "1e300"),
            "lens.json: \"width\" is 1e+300; it must be a whole number from 1 to 65535");
  EXPECT_EQ(refusal("height", "0"), "lens.json: \"height\" is 0; it must be a whole number from 1 to 65535");
  EXPECT_EQ(refusal("pictures", "-1e300"),
            "lens.json: \"pictures\" is -1e+300; it must be a whole number from 0 to 1000000");
  EXPECT_EQ(refusal("focal_px", "[1e300, 1]"),
            "lens.json: \"focal_px\" is 1e+300; it must lie between 1 and 1e+06");
  EXPECT_EQ(refusal("centre_px", "[0, -1e300]"),
            "lens.json: \"centre_px\" is -1e+300; it must lie between -1e+06 and 1e+06");
  EXPECT_EQ(refusal("distortion", "[0, 0, 1e200, 0, 0]"),
            "lens.json: \"distortion\" is 1e+200; it must lie between -1000 and 1000");
  EXPECT_EQ(refusal("reprojection_rms_px", "-1"),
            "lens.json: \"reprojection_rms_px\" is -1; it must lie between 0 and 1e+06");
  EXPECT_EQ(refusal("width", "1280"), "accepted");
}

TEST(Lens, ADistortionThatNothingUndoesIsRefused) {
  Lens lens = ordinary_lens(1279, 719);
  lens.focal_px = {1408, 10};
  lens.centre_px = {0, 10};
  lens.distortion = {0, -1, 0, 1, 0};
  const std::string why =
      io::message_of<io::InputError>([&] { (void)lens_from_json(to_json(lens), "lens.json"); });
  EXPECT_TRUE(why.starts_with("lens.json: the distortion has no answer at the picture's")) << why;
}

TEST(Lens, TheErrorAtTheEdgeGrowsWithTheBone) {
  EXPECT_GT(edge_error_deg(1280, 720, 100), 0.1);
  EXPECT_LT(edge_error_deg(1280, 720, 100), 2);
  EXPECT_NEAR(edge_error_deg(1280, 720, 200) / edge_error_deg(1280, 720, 100), 2, 0.2);
}

TEST(Lens, CalibrationRefusesTooFewOrUnreadablePictures) {
  EXPECT_THROW(fit_lens({}, {}), io::InputError);
  const auto path = scratch("wall.png");
  std::ofstream(path) << "no picture";
  EXPECT_THROW(fit_lens({path}, {}), io::InputError);
  EXPECT_THROW(fit_lens({path}, {1, 1}), io::InputError);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace flexor::camera
