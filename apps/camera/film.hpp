// The twin's hands in front of the twin's cameras, and what the trackers make of the pictures.
#pragma once

#include <array>
#include <vector>

#include "apps/camera/picture.hpp"
#include "host/camera/joints.hpp"
#include "host/twin/parameters.hpp"

namespace flexor::filming {

inline const Bgr kGreen = {50, 150, 40};
inline const Bgr kBlue = {190, 90, 30};

// Five fingers side by side, each in a fifth of the picture, before an ordinary camera: a little noise, light that falls off to
// one side. No real hand shows itself like that; a laboratory would use a camera for every finger that another one hides. Marks
// on palm and joints as in models/joints/paper_hand.json, link lengths of an adult, bones are rods, joints pins.
inline constexpr int kFilmWidth = 960;
inline constexpr int kFilmHeight = 540;
Renderer hand_camera(std::uint64_t seed);
// Five MCP angles in the article's convention (thumb 90 when straight, others 0); the other joints follow by its eqs. 4 and 5.
Scene hand_scene(const twin::PerFinger& mcp_deg, const Bgr& paint = kGreen);

// A joint file of the drawn hand (models/joints/paper_hand.json), with lengths that are known.
camera::Joints drawn_hand(camera::Joints joints);

using FingerAngles = std::array<std::vector<float>, twin::kFingers>;  // of each frame, degrees

// Exact angles become tracked ones: the hand drawn and tracked, frame by frame. Throws io::JobError when the tracker loses a
// finger, which it never should in these pictures.
void track_drawn(const camera::Joints& joints, Renderer& film, FingerAngles& angles, double rate_hz,
                 const Bgr& paint);

}  // namespace flexor::filming
