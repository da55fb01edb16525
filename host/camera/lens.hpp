// What the lens does to points, from pictures of a checkerboard.
//
//   x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),   u = f_x x' + c_x,   likewise y
// with x, y on the plane at distance 1 (pinhole and Brown-Conrady model). A lens file:
//   {"schema": "flexor-lens", "schema_version": 1, "width", "height", "focal_px": [x, y], "centre_px": [x,
//   y],
//    "distortion": [k1, k2, p1, p2, k3], "reprojection_rms_px", "pictures"}
// with sides up to 65535 pixels, focal lengths from 1 and centres to 1e6 pixels, coefficients to 1000 either
// way. Source: Z. Zhang, IEEE Transactions on Pattern Analysis 22 (2000) 1330-1334; D. C. Brown, 1966.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "host/camera/picture.hpp"

namespace flexor::camera {

struct Lens {
  int width = 0;
  int height = 0;
  Point focal_px;
  Point centre_px;
  std::array<double, 5> distortion{};  // k1, k2, p1, p2, k3
  double reprojection_rms_px = 0;
  int pictures = 0;

  // Where the point would be without distortion, same focal length. A picture of another size than the lens
  // was calibrated with is an error of the caller's: see require_size.
  Point undistort(Point p) const;
  cv::Matx33d matrix() const { return {focal_px.x, 0, centre_px.x, 0, focal_px.y, centre_px.y, 0, 0, 1}; }
  // Throws io::InputError.
  void require_size(int picture_width, int picture_height, const std::string& source) const;
};

// An undistorted lens of a usual field of view: focal length 1.1 times the width, which is 49 degrees.
Lens ordinary_lens(int width, int height);

// Throws io::InputError naming file and field.
Lens load_lens(const std::filesystem::path& path);
Lens lens_from_json(const std::string& text, const std::string& source);
std::string to_json(const Lens& lens);

struct Board {
  int columns = 9;  // inner corners
  int rows = 6;
};

struct LensFit {
  Lens lens;
  std::vector<std::string> used;
  std::vector<std::string> refused;  // file: reason
};

// Throws io::InputError: unreadable pictures, of different sizes, fewer than five with the whole board in
// sight; io::JobError: views too alike to determine the lens.
LensFit fit_lens(const std::vector<std::filesystem::path>& pictures, const Board& board);

// Largest error, degrees, of a straight joint whose two bones of bone_px lie at the picture's corner, under a
// lens of k1 = -0.1, as ordinary webcams have.
double edge_error_deg(int width, int height, double bone_px);

}  // namespace flexor::camera
