// The articulated hand as a camera sees it, with marks on its joints and exact angles.
//
// pinch: thumb and index finger from the side, marks wrist, index_mcp, index_pip, index_dip, index_tip,
// thumb_mcp, thumb_ip, thumb_tip, as in models/joints/green_markers.json; printed marks on the index finger's
// four links. spread: five fingers side by side, each in a fifth of the picture, as in
// models/joints/paper_hand.json. No real hand shows itself like that; a laboratory would use a camera for
// every finger that another one hides. Link lengths: the proportions of an adult's hand, millimetres. Bones
// are rods, joints pins.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/twin/parameters.hpp"
#include "host/twin/picture.hpp"

namespace flexor::twin {

inline constexpr Bgr kSkin = {120, 150, 205};
inline constexpr Bgr kGreen = {50, 150, 40};
inline constexpr Bgr kBlue = {190, 90, 30};

// Degrees, flexion positive, zero when straight; the thumb's cmc is the angle between the two metacarpals.
struct PinchPose {
  double index_mcp = 0;
  double index_pip = 0;
  double index_dip = 0;
  double thumb_cmc = 45;
  double thumb_mcp = 0;
  double thumb_ip = 0;
};

struct Drawn {
  Scene scene;
  std::vector<std::string> names;
  std::vector<Place> marks;  // on the plane
};

// `at` is the wrist; `turn_deg` turns the whole hand in the plane, `mirror` shows its other side.
struct Stance {
  Place at = {60, 20};
  double turn_deg = 0;
  bool mirror = false;
  Bgr paint = kGreen;
  double mark_mm = 3.5;  // radius
};

Drawn draw_pinch(const PinchPose& pose, const Stance& stance);

// The index finger of the same hand with `prints` on metacarpal, proximal, middle and distal link; `cell_mm`
// of each is taken as it is, place and turn are set.
Drawn draw_printed(const PinchPose& pose, const Stance& stance, const std::array<Pattern, 4>& prints);

// Five MCP angles in the article's convention (thumb 90 when straight, others 0); the other joints follow by
// its eqs. 4 and 5. Marks finger by finger: palm, mcp, pip, dip, tip (thumb: palm, mcp, ip, tip).
Drawn draw_spread(const PerFinger& mcp_deg, Bgr paint);

}  // namespace flexor::twin
