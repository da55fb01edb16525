// A place that moves on, its rate driven by white noise of spectral density q: Kalman's filter of both, for one coordinate or for
// several with one covariance.
#pragma once

#include <Eigen/Core>

namespace flexor::camera {

template <int kCoordinates>
struct Motion {
  using Place = Eigen::Matrix<double, 1, kCoordinates>;

  Eigen::Matrix<double, 2, kCoordinates> state =
      Eigen::Matrix<double, 2, kCoordinates>::Zero();  // place, rate
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();

  static Eigen::Matrix2d step(double h_s) { return Eigen::Matrix2d{{1, h_s}, {0, 1}}; }

  Motion after(double h_s, double density) const {
    const Eigen::Matrix2d noise{{h_s * h_s * h_s / 3, h_s * h_s / 2}, {h_s * h_s / 2, h_s}};
    return {step(h_s) * state, step(h_s) * covariance * step(h_s).transpose() + density * noise};
  }

  // By a place that was measured with this variance.
  void update(const Place& measured, double variance) {
    const Eigen::Vector2d gain = covariance.col(0) / (covariance(0, 0) + variance);
    state += gain * (measured - state.row(0));
    covariance -= gain * covariance.row(0).eval();
  }
};

}  // namespace flexor::camera
