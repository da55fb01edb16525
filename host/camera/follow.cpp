#include "host/camera/follow.hpp"

#include <algorithm>
#include <cmath>

namespace flexor::camera {
namespace {

constexpr double kMeasured_px2 = 0.25;        // a mark's centre wanders by half a pixel as it turns
constexpr double kFirstSpeed_px_s = 300;      // standard deviation
constexpr double kLeastDensity_px2_s3 = 1e4;  // px^2/s^3
constexpr double kMostDensity = 1e8;
constexpr double kLearn = 0.15;
constexpr double kFade_s = 0.3;

}  // namespace

void MarkPredictor::begin(double t_s, Point at) {
  t_s_ = t_s;
  position_ = at;
  velocity_ = {};
  p00_ = kMeasured_px2;
  p01_ = 0;
  p11_ = kFirstSpeed_px_s * kFirstSpeed_px_s;
  density_ = 10 * kLeastDensity_px2_s3;
}

Point MarkPredictor::at(double t_s) const {
  const double h = t_s - t_s_;
  return {position_.x + h * velocity_.x, position_.y + h * velocity_.y};
}

double MarkPredictor::sigma_px(double t_s) const {
  const double h = t_s - t_s_;
  return std::sqrt(p00_ + 2 * h * p01_ + h * h * p11_ + density_ * h * h * h / 3);
}

void MarkPredictor::predict(double t_s) {
  const double h = t_s - t_s_;
  position_ = at(t_s);
  p00_ += 2 * h * p01_ + h * h * p11_ + density_ * h * h * h / 3;
  p01_ += h * p11_ + density_ * h * h / 2;
  p11_ += density_ * h;
  t_s_ = t_s;
}

void MarkPredictor::update(double t_s, Point z) {
  predict(t_s);
  const double s = p00_ + kMeasured_px2;
  const double dx = z.x - position_.x;
  const double dy = z.y - position_.y;
  const double surprise = (dx * dx + dy * dy) / (2 * s) - 1;
  density_ = std::clamp(density_ * std::exp(kLearn * std::clamp(surprise, -1.0, 4.0)), kLeastDensity_px2_s3,
                        kMostDensity);
  const double g0 = p00_ / s;
  const double g1 = p01_ / s;
  position_ = {position_.x + g0 * dx, position_.y + g0 * dy};
  velocity_ = {velocity_.x + g1 * dx, velocity_.y + g1 * dy};
  p11_ -= g1 * p01_;
  p01_ *= 1 - g0;
  p00_ *= 1 - g0;
}

void MarkPredictor::skip(double t_s) {
  const double fade = std::exp(-(t_s - t_s_) / kFade_s);
  predict(t_s);
  velocity_ = {velocity_.x * fade, velocity_.y * fade};
}

}  // namespace flexor::camera
