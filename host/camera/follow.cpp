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
  motion_.state << at.x, at.y, 0, 0;
  motion_.covariance = Eigen::Vector2d(kMeasured_px2, kFirstSpeed_px_s * kFirstSpeed_px_s).asDiagonal();
  density_ = 10 * kLeastDensity_px2_s3;
}

Point MarkPredictor::at(double t_s) const {
  const Motion<2>::Place place = after(t_s).state.row(0);
  return {place(0), place(1)};
}

double MarkPredictor::sigma_px(double t_s) const { return std::sqrt(after(t_s).covariance(0, 0)); }

void MarkPredictor::update(double t_s, Point z) {
  const Motion<2>::Place measured(z.x, z.y);
  motion_ = after(t_s);
  t_s_ = t_s;
  const double variance = motion_.covariance(0, 0) + kMeasured_px2;
  const double surprise = (measured - motion_.state.row(0)).squaredNorm() / (2 * variance) - 1;
  density_ = std::clamp(density_ * std::exp(kLearn * std::clamp(surprise, -1.0, 4.0)), kLeastDensity_px2_s3,
                        kMostDensity);
  motion_.update(measured, kMeasured_px2);
}

void MarkPredictor::skip(double t_s) {
  motion_ = after(t_s);
  motion_.state.row(1) *= std::exp(-(t_s - t_s_) / kFade_s);
  t_s_ = t_s;
}

}  // namespace flexor::camera
