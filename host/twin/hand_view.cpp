#include "host/twin/hand_view.hpp"

#include <cmath>
#include <numbers>

#include "host/model/model.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::twin {
namespace {

// Of an adult's hand, mm: metacarpal, proximal, middle, distal.
constexpr std::array<double, 4> kIndex = {68, 40, 23, 20};
constexpr std::array<double, 3> kThumb = {46, 32, 24};
constexpr std::array<double, 4> kRadius = {11, 9, 8, 7};

// A chain of rods with a mark at each end.
class Chain {
 public:
  Chain(Drawn& drawn, Place start, double heading_deg, const Stance& stance)
      : drawn_(drawn), at_(start), heading_deg_(heading_deg), stance_(stance) {}

  // Turns on the spot: clockwise on the screen is positive, the other way in a mirror.
  void turn(double deg) { heading_deg_ += stance_.mirror ? -deg : deg; }

  void link(double length_mm, double radius_mm) {
    const double a = heading_deg_ * std::numbers::pi / 180;
    const Place from = at_;
    at_ = {from.x + length_mm * std::cos(a), from.y + length_mm * std::sin(a)};
    drawn_.scene.rods.push_back({from, at_, radius_mm, kSkin});
  }

  void print(Pattern print) {
    const Rod& rod = drawn_.scene.rods.back();
    print.centre = {(rod.a.x + rod.b.x) / 2, (rod.a.y + rod.b.y) / 2};
    print.turn_deg = heading_deg_;
    drawn_.scene.patterns.push_back(std::move(print));
  }

  void mark(const std::string& name) {
    drawn_.names.push_back(name);
    drawn_.marks.push_back(at_);
    drawn_.scene.discs.push_back({at_, stance_.mark_mm, stance_.paint});
  }

 private:
  Drawn& drawn_;
  Place at_;
  double heading_deg_;
  const Stance& stance_;
};

// The hand points to the upper left: index finger above the thumb, both flex towards each other.
constexpr double kHeading_deg = 215;

double index_heading(const Stance& s) {
  return (s.mirror ? 180.0 - kHeading_deg : kHeading_deg) + s.turn_deg;
}

}  // namespace

Drawn draw_pinch(const PinchPose& pose, const Stance& stance) {
  Drawn out;
  Chain index(out, stance.at, index_heading(stance), stance);
  index.mark("wrist");
  index.link(kIndex[0], kRadius[0]);
  index.mark("index_mcp");
  index.turn(-pose.index_mcp);
  index.link(kIndex[1], kRadius[1]);
  index.mark("index_pip");
  index.turn(-pose.index_pip);
  index.link(kIndex[2], kRadius[2]);
  index.mark("index_dip");
  index.turn(-pose.index_dip);
  index.link(kIndex[3], kRadius[3]);
  index.mark("index_tip");
  Chain thumb(out, stance.at, index_heading(stance), stance);
  thumb.turn(-pose.thumb_cmc);
  thumb.link(kThumb[0], kRadius[0]);
  thumb.mark("thumb_mcp");
  thumb.turn(pose.thumb_mcp);
  thumb.link(kThumb[1], kRadius[1]);
  thumb.mark("thumb_ip");
  thumb.turn(pose.thumb_ip);
  thumb.link(kThumb[2], kRadius[2]);
  thumb.mark("thumb_tip");
  return out;
}

Drawn draw_printed(const PinchPose& pose, const Stance& stance, const std::array<Print, 4>& prints) {
  Drawn out;
  Chain index(out, stance.at, index_heading(stance), stance);
  index.link(kIndex[0], kRadius[0]);
  index.print(prints[0]);
  index.turn(-pose.index_mcp);
  index.link(kIndex[1], kRadius[1]);
  index.print(prints[1]);
  index.turn(-pose.index_pip);
  index.link(kIndex[2], kRadius[2]);
  index.print(prints[2]);
  index.turn(-pose.index_dip);
  index.link(kIndex[3], kRadius[3]);
  index.print(prints[3]);
  return out;
}

Drawn draw_spread(const PerFinger& mcp_deg, Bgr paint) {
  constexpr double kColumn_mm = 104;
  constexpr double kLeft_mm = 38;  // of the column's middle: bent fingers reach to the right
  constexpr double kBase_mm = 50;
  constexpr double kPalm_mm = 30;
  constexpr double kStraightThumb_deg = 90;
  Stance stance;
  stance.paint = paint;
  Drawn out;
  for (int i = 0; i < kFingers; ++i) {
    const std::string& finger = model::finger_names()[static_cast<std::size_t>(i)];
    const bool is_thumb = i == 0;
    const double mcp = mcp_deg[static_cast<std::size_t>(i)] - (is_thumb ? kStraightThumb_deg : 0);
    const Posture joints = posture(i, mcp);
    Chain chain(out, {(i - 2) * kColumn_mm - kLeft_mm, kBase_mm}, -90, stance);
    chain.mark(finger + "_palm");
    chain.link(kPalm_mm, kRadius[0]);
    chain.mark(finger + "_mcp");
    chain.turn(joints.mcp_deg);
    chain.link(is_thumb ? kThumb[1] : kIndex[1], kRadius[1]);
    chain.mark(finger + (is_thumb ? "_ip" : "_pip"));
    chain.turn(joints.pip_deg);
    chain.link(is_thumb ? kThumb[2] : kIndex[2], kRadius[2]);
    chain.mark(finger + (is_thumb ? "_tip" : "_dip"));
    if (is_thumb) continue;
    chain.turn(joints.dip_deg);
    chain.link(kIndex[3], kRadius[3]);
    chain.mark(finger + "_tip");
  }
  return out;
}

}  // namespace flexor::twin
