// Pictures of flat things under a pinhole camera with a real lens: discs, rods and patterns in one plane.
//
// A point (X, Y) of the plane, millimetres, Y downwards, is turned by turn and tilt about the plane's
// origin and put distance_mm in front of the camera:
//   (x, y, z)' = R (X, Y, 0)' + (0, 0, distance)',   p = (x / z, y / z),   r = |p|
//   pixel = focal p (1 + k1 r^2 + k2 r^4) + centre
// A pixel shows the mean of 16 points inside it, so that a disc's centre of gravity is its centre to about
// 0.01 pixel. Then light, blur, noise, rounding. Seeded: the same scene and frame number give the same
// picture.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/twin/random.hpp"

namespace flexor::twin {

struct Place {
  double x = 0;
  double y = 0;
};

using Bgr = std::array<std::uint8_t, 3>;

struct Rod {  // round ends
  Place a;
  Place b;
  double radius_mm = 0;
  Bgr colour{};
};

struct Disc {
  Place centre;
  double radius_mm = 0;
  Bgr colour{};
};

// columns x rows square cells, row by row, 1 white and 0 black: a printed mark, a checkerboard.
struct Pattern {
  Place centre;
  double turn_deg = 0;
  double cell_mm = 0;
  int columns = 0;
  int rows = 0;
  std::vector<std::uint8_t> cells;
};

// Painted in this order.
struct Scene {
  std::vector<Rod> rods;
  std::vector<Pattern> patterns;
  std::vector<Disc> discs;
  std::vector<Rod> in_front;  // hides what is behind
};

struct View {
  int width = 1280;
  int height = 720;
  double focal_px = 1400;
  double distance_mm = 420;
  double turn_deg = 0;  // about the picture's vertical axis
  double tilt_deg = 0;  // about its horizontal axis
  Place centre_px = {639.5, 359.5};
  double k1 = 0;
  double k2 = 0;
};

struct Look {
  Bgr background = {150, 148, 146};
  double gradient = 0;  // the right edge is that share darker than the left one
  double light = 1;
  double blur_px = 0;  // standard deviation of a Gaussian
  double noise = 0;    // standard deviation, grey levels
};

class Renderer {
 public:
  Renderer(const View& view, const Look& look, std::uint64_t seed);

  // Blue, green, red; 3 * width * height bytes.
  void draw(const Scene& scene, std::uint64_t frame, std::vector<std::uint8_t>& bgr);

  // Where a point of the plane is in the picture.
  Place project(Place on_plane) const;
  void set_light(double light);

 private:
  struct Box {
    int left, top, right, bottom;
  };
  Place unproject(double u, double v) const;
  Box box(const std::vector<Place>& outline) const;
  template <class Inside>
  void paint(const Box& painted, Inside&& inside);
  void paint_rod(const Rod& rod);
  void paint_pattern(const Pattern& pattern);
  void blur(const Box& box);

  View view_;
  Look look_;
  std::uint64_t seed_;
  std::array<std::array<double, 3>, 3> turn_{};
  std::vector<std::array<float, 2>> plane_;  // where the centre of each pixel is on the plane
  std::vector<float> empty_;                 // the background, lit
  Box touched_{};                            // what has been painted on since the background
  std::vector<float> canvas_;
  std::vector<float> scratch_;
  std::vector<float> noise_;
};

}  // namespace flexor::twin
