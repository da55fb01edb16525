// Where a mark will be in the next picture: a Kalman filter for both coordinates with one covariance.
//
// State (position, velocity), driven by white acceleration of density q (px^2/s^3), which follows the
// innovations: after nu^2 / S on average 1 it stays, above it grows.
#pragma once

#include "host/camera/motion.hpp"
#include "host/camera/picture.hpp"

namespace flexor::camera {

class MarkPredictor {
 public:
  void begin(double t_s, Point at);

  // Where it will be, and the standard deviation of that.
  Point at(double t_s) const;
  double sigma_px(double t_s) const;

  void update(double t_s, Point measured);
  // Nothing was seen: the velocity fades, so that a hidden mark does not fly away.
  void skip(double t_s);

 private:
  Motion<2> after(double t_s) const { return motion_.after(t_s - t_s_, density_); }

  double t_s_ = 0;
  Motion<2> motion_;
  double density_ = 0;
};

}  // namespace flexor::camera
