// The twin's hands in front of the twin's cameras, and what the trackers make of the pictures.
#pragma once

#include <array>
#include <vector>

#include "host/camera/joints.hpp"
#include "host/camera/picture.hpp"
#include "host/twin/parameters.hpp"
#include "host/twin/picture.hpp"

namespace flexor::filming {

// Five fingers side by side before an ordinary camera: a little noise, light that falls off to one side.
class HandFilm {
 public:
  static constexpr int kWidth = 960;
  static constexpr int kHeight = 540;

  explicit HandFilm(std::uint64_t seed);

  // The article's five MCP angles. The picture is valid until the next call.
  const camera::Picture& shoot(const twin::PerFinger& mcp_deg, std::uint64_t frame, twin::Bgr paint);

 private:
  twin::Renderer renderer_;
  camera::Picture picture_;
};

// A joint file of the drawn hand (models/joints/paper_hand.json), with lengths that are known.
camera::Joints drawn_hand(camera::Joints joints);

using FingerAngles = std::array<std::vector<float>, twin::kFingers>;  // of each frame, degrees

// Exact angles in, tracked ones out: both hands drawn and tracked, frame by frame. Throws io::JobError when a
// tracker loses a finger, which it never should in these pictures.
struct Sight {
  FingerAngles glove_deg;
  FingerAngles hand_deg;
};
Sight see(const camera::Joints& joints, Sight exact, double rate_hz, std::uint64_t seed);

}  // namespace flexor::filming
