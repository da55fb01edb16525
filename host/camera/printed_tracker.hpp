// Printed marks (AprilTag 36h11) on the links of a hand: angles in 3-D, whichever way the hand is turned.
//
// Each mark gives the rotation R of its link in the camera's frame (four corners, a square of known side,
// Collins and Bartoli's closed form). The joint between links a and b turns about the marks' common normal:
//   angle = atan2(M21 - M12, M11 + M22),   M = R_a' R_b
// A square seen from far away fits two rotations that mirror each other; of all marks together those are
// taken whose normals agree best. Corners are where straight lines through the square's edges cross, and what
// the edges leave over from straight is the corner noise sigma; standard error of a mark's turn about its
// normal: sigma / (sqrt(2) side). Source: E. Olson, ICRA 2011; T. Collins, A. Bartoli, Int. J. Computer
// Vision 109 (2014) 252-286.
#pragma once

#include "host/camera/colour_tracker.hpp"

namespace flexor::camera {

class PrintedTracker {
 public:
  PrintedTracker(const Skeleton& skeleton, const Lens& lens) : skeleton_(skeleton), lens_(lens) {}

  Observation step(const Picture& picture, double t_s);
  const std::string& trouble() const { return trouble_; }

 private:
  Skeleton skeleton_;
  Lens lens_;
  std::string trouble_;
};

}  // namespace flexor::camera
