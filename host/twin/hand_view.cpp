#include "host/twin/hand_view.hpp"

#include <cmath>
#include <numbers>

#include "host/model/model.hpp"
#include "host/twin/simulation.hpp"

namespace flexor::twin {
namespace {

// Of an adult's hand, mm: metacarpal, proximal, middle, distal.
const std::vector<double> kIndex = {68, 40, 23, 20};
const std::vector<double> kThumb = {46, 32, 24};
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

  // Each turned against the one before, with a mark where it ends: finger and one of `names`.
  void links(const std::string& finger, const std::vector<double>& length_mm,
             const std::vector<double>& turn_deg, const std::vector<const char*>& names) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      turn(turn_deg[k]);
      link(length_mm[k], kRadius[k]);
      mark(finger + names[k]);
    }
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

std::vector<double> flexed(const PinchPose& p) { return {0, -p.index_mcp, -p.index_pip, -p.index_dip}; }

}  // namespace

Drawn draw_pinch(const PinchPose& pose, const Stance& stance) {
  Drawn out;
  Chain index(out, stance.at, index_heading(stance), stance);
  index.mark("wrist");
  index.links("index_", kIndex, flexed(pose), {"mcp", "pip", "dip", "tip"});
  Chain thumb(out, stance.at, index_heading(stance), stance);
  thumb.links("thumb_", kThumb, {-pose.thumb_cmc, pose.thumb_mcp, pose.thumb_ip}, {"mcp", "ip", "tip"});
  return out;
}

Drawn draw_printed(const PinchPose& pose, const Stance& stance, const std::array<Pattern, 4>& prints) {
  Drawn out;
  Chain index(out, stance.at, index_heading(stance), stance);
  for (std::size_t k = 0; k < prints.size(); ++k) {
    index.turn(flexed(pose)[k]);
    index.link(kIndex[k], kRadius[k]);
    index.print(prints[k]);
  }
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
    if (is_thumb)
      chain.links("thumb_", {kPalm_mm, kThumb[1], kThumb[2]}, {0, joints.mcp_deg, joints.pip_deg},
                  {"mcp", "ip", "tip"});
    else
      chain.links(finger + "_", {kPalm_mm, kIndex[1], kIndex[2], kIndex[3]},
                  {0, joints.mcp_deg, joints.pip_deg, joints.dip_deg}, {"mcp", "pip", "dip", "tip"});
  }
  return out;
}

}  // namespace flexor::twin
