// Where a mark will be in the next picture: a Kalman filter for both coordinates with one covariance.
//
// State (position, velocity), driven by white acceleration of density q (px^2/s^3), which follows the
// innovations: after nu^2 / S on average 1 it stays, above it grows.
#pragma once

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
  void predict(double t_s);

  double t_s_ = 0;
  Point position_;
  Point velocity_;
  double p00_ = 0;
  double p01_ = 0;
  double p11_ = 0;
  double density_ = 0;
};

}  // namespace flexor::camera
