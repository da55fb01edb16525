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

// Measures what was found before, in windows around where it is expected. Keeps its memory from one picture
// to the next.
class MarkMeter {
 public:
  // nullopt: nothing there that looks like it. Marks that share a blob are parted by which expected centre is
  // nearest.
  void measure(const Picture& picture, const ColourModel& colour, const std::vector<Expected>& expected,
               std::vector<std::optional<Mark>>& out);

 private:
  struct Patch {
    Window window;
    std::vector<float> score;
    std::vector<std::uint8_t> label;
    double background = 0;
    double noise = 0;
  };
  std::optional<Mark> measure_one(const Picture& picture, const ColourModel& colour,
                                  const std::vector<Expected>& expected, std::size_t k);
  void look(const Picture& picture, const ColourModel& colour, const Expected& expected);
  int find_blob(const Expected& expected, double threshold);
  double level() const;
  void part(const std::vector<Expected>& expected, std::size_t k);
  bool add_rim();
  Mark centre(double level) const;
  Point centre_at(double middle, double level) const;
  bool at_border() const;

  Patch patch_;
};

}  // namespace flexor::camera
