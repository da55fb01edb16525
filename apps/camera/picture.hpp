// Pictures of flat things before a real camera: rods, discs and printed patterns in one plane.
//
// A point (X, Y) of the plane, millimetres, Y downwards, is turned by tilt about the plane's horizontal axis, then by turn about
// its vertical one, put distance_mm in front of the camera and seen through its lens (lens.hpp). A pixel shows the mean of 16
// points inside it, so that a disc's centre of gravity is its centre to about 0.01 pixel. Then blur, light, noise, rounding.
// Seeded: the same scene and frame number give the same picture.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "host/camera/lens.hpp"
#include "host/camera/picture.hpp"

namespace flexor::filming {

using Bgr = cv::Vec3b;

struct Rod {  // round at both ends; a disc where both are one point
  camera::Point a;
  camera::Point b;
  double radius_mm = 0;
  Bgr colour;
};

// columns x rows square cells, row by row, 1 white and 0 black: a printed mark, a checkerboard.
struct Pattern {
  camera::Point centre;
  double turn_deg = 0;
  double cell_mm = 0;
  int columns = 0;
  int rows = 0;
  std::vector<std::uint8_t> cells;
};

// Painted in this order.
struct Scene {
  std::vector<Rod> links;
  std::vector<Pattern> prints;
  std::vector<Rod> marks;
};

// A finger: rods, each turned against the one before, with marks where they end.
class Chain {
 public:
  Chain(Scene& scene, camera::Point start, double heading_deg, const Bgr& paint)
      : scene_(scene), at_(start), heading_deg_(heading_deg), paint_(paint) {}

  void link(double length_mm, double turn_deg);  // clockwise on the screen is positive
  void mark();
  void marked_links(const std::vector<double>& length_mm, const std::vector<double>& turn_deg);
  // On the newest link's middle.
  void print(Pattern pattern);

 private:
  Scene& scene_;
  camera::Point at_;
  camera::Point from_;
  double heading_deg_;
  Bgr paint_;
  std::size_t links_ = 0;
};

struct View {
  camera::Lens lens;
  double distance_mm = 420;
  double turn_deg = 0;
  double tilt_deg = 0;
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

  // The picture is valid until the next call.
  const camera::Picture& draw(const Scene& scene, std::uint64_t frame);
  void set_light(double light);

 private:
  template <class ColourAt>
  void paint(const std::vector<cv::Point3d>& outline, const ColourAt& colour_at);
  void paint(const Rod& rod);
  void paint(const Pattern& pattern);

  View view_;
  Look look_;
  std::uint64_t seed_;
  cv::Matx33d turn_;
  cv::Mat plane_;  // where the centre of each pixel is on the plane
  cv::Mat canvas_;
  cv::Mat light_;
  cv::Mat noise_;     // of twice the picture's sides, to be laid over it anywhere
  cv::Rect touched_;  // what has been painted on
  camera::Picture picture_;
};

}  // namespace flexor::filming
