// For tests and benchmarks: thumb and index finger from the side, as a camera sees them, exact angles known.
#pragma once

#include <array>
#include <vector>

#include "apps/camera/film.hpp"

namespace flexor::filming {

// Degrees, flexion positive, zero when straight; the thumb's cmc is the angle between the two metacarpals.
struct PinchPose {
  double index_mcp = 0;
  double index_pip = 0;
  double index_dip = 0;
  double thumb_cmc = 45;
  double thumb_mcp = 0;
  double thumb_ip = 0;
};

// `at` is the wrist; `turn_deg` turns the whole hand in the plane.
struct Stance {
  camera::Point at = {60, 20};
  double turn_deg = 0;
  Bgr paint = kGreen;
};

// The hand points to the upper left: index finger above the thumb, both flex towards each other.
inline constexpr double kHeading_deg = 215;
inline const std::vector<double> kIndex_mm = {68, 40, 23, 20};

// Marks as in models/joints/green_markers.json.
inline Scene draw_pinch(const PinchPose& p, const Stance& stance) {
  Scene out;
  Chain index(out, stance.at, kHeading_deg + stance.turn_deg, stance.paint);
  index.mark();
  index.marked_links(kIndex_mm, {0, -p.index_mcp, -p.index_pip, -p.index_dip});
  Chain thumb(out, stance.at, kHeading_deg + stance.turn_deg, stance.paint);
  thumb.marked_links({46, 32, 24}, {-p.thumb_cmc, p.thumb_mcp, p.thumb_ip});
  return out;
}

// The index finger of the same hand with a print on each link.
inline Scene draw_printed(const PinchPose& p, const Stance& stance, const std::array<Pattern, 4>& prints) {
  Scene out;
  Chain index(out, stance.at, kHeading_deg + stance.turn_deg, stance.paint);
  const std::array<double, 4> turn_deg = {0, -p.index_mcp, -p.index_pip, -p.index_dip};
  for (std::size_t k = 0; k < prints.size(); ++k) {
    index.link(kIndex_mm[k], turn_deg[k]);
    index.print(prints[k]);
  }
  return out;
}

// 1280 x 720; at 420 mm the index finger is 500 pixels long from wrist to tip.
inline View pinch_view() {
  View out;
  out.lens = camera::ordinary_lens(1280, 720);
  out.lens.focal_px = {1400, 1400};
  return out;
}

}  // namespace flexor::filming
