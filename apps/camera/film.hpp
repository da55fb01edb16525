// The twin's hands in front of the twin's cameras, and what the trackers make of the pictures.
#pragma once

#include <array>
#include <vector>

#include "host/camera/joints.hpp"
#include "host/camera/picture.hpp"
#include "host/study/trials.hpp"
#include "host/twin/picture.hpp"

namespace flexor::filming {

using namespace study;

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

// models/joints/paper_hand.json, with lengths that are known.
camera::Joints paper_hand();

// An engine whose cameras see pictures: plays on `inner` (null: the twin) and tracks both hands frame by
// frame. Throws io::JobError when a tracker loses a finger, which it never should in these pictures.
std::unique_ptr<Engine> filmed(Engine* inner);

}  // namespace flexor::filming
