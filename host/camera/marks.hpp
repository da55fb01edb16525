// Colour marks in a picture: where their centres are, to a fraction of a pixel, and how well that is known.
//
// In a window the surroundings score b (the median) and the mark b + L. Pixels above b + L / 2 that touch
// each other are the mark; every pixel p of it or within two pixels of it weighs
//   w(p) = clamp((s(p) - b - L / 4) / (L / 2), 0, 1),   centre = sum w p / sum w,
// so that shading inside the mark does not matter and edges count by how much they are covered. Only pixels
// on the edge, 0 < w < 1, feel noise of standard deviation sigma in s:
//   covariance = ((2 sigma / L)^2 + a) sum_edge (p - centre)(p - centre)' / (sum w)^2  +  d d' / 12
// sigma is measured in the same window, from differences of neighbours, and is at least the 1 / sqrt(12) of
// rounding to whole grey levels; a is what sampling an edge sharper than a pixel costs; d is how far the
// centre moves when the quarter and three quarters above become an eighth and five eighths, or three and
// seven eighths: an irregular mark has no one centre.
#pragma once

#include <optional>
#include <vector>

#include "host/camera/colour.hpp"
#include "host/camera/picture.hpp"

namespace flexor::camera {

struct Mark {
  Point centre;
  Covariance covariance{};
  double area_px = 0;
  double level = 0;       // L
  bool touching = false;  // something else of this colour touches it, or nearly
  bool at_edge = false;   // touches the picture's edge: part of it may be missing
};

// Smaller things than this are no marks.
double least_area_px(const ColourModel& colour);

// All marks in `region`, of at least min_area_px. Whole pictures: for finding, not for following.
std::vector<Mark> find_marks(const Picture& picture, const ColourModel& colour, const Window& region,
                             double min_area_px);

// Where one mark is expected, and what it looked like.
struct Expected {
  Point at;
  double reach_px = 0;  // it may be that far from there
  double area_px = 0;
  double level = 0;
};

// What was found before, in windows around where it is expected; nullopt: nothing there that looks like it. Marks that share a
// blob are parted by which expected centre is nearest.
std::vector<std::optional<Mark>> measure_marks(const Picture& picture, const ColourModel& colour,
                                               const std::vector<Expected>& expected);

}  // namespace flexor::camera
