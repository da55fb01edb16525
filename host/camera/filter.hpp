// Angles over time: gaps of hidden marks closed, noise taken out as far as the motion allows, no lag.
//
// Each angle follows x = (angle, rate), d rate = white noise of spectral density q (deg^2/s^3), measured with
// the variance that came with it. A Kalman filter runs forward and a Rauch-Tung-Striebel smoother back over
// the next kLag frames: what comes out is kLag frames old and knows both its past and its future. q is the
// largest that the second differences of the measurements ask for anywhere in the window, so that a sudden
// motion is followed and only rest is smoothed.
//
// Paint that changes its shape as a finger turns makes a mark wander by more than its picture shows. White
// noise of variance R on the angle shows in its second differences, c0 = 6 R + (2/3) q h^3 and c1 = -4 R +
// (1/6) q h^3 at lags 0 and 1, of which R is solved over the last second or two; where it is larger than
// the marks' variance, it counts. Source: H. E. Rauch, F. Tung, C. T. Striebel, AIAA Journal 3 (1965) 1445-1450.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "host/camera/angles.hpp"
#include "host/camera/motion.hpp"

namespace flexor::camera {

inline constexpr std::size_t kMaxHidden = 10;  // frames that a mark may be hidden; longer is lost
inline constexpr std::size_t kLag = 12;

enum class Quality {
  good = 0,
  doubtful = 1,  // measured, but marks touch, a bone has an odd length, or the joint is outside its range
  hidden = 2,    // a mark is hidden: from the motion before and after
  lost = 3,      // not known: the last value, with a standard error of 180 degrees
};

struct FilteredAngle {
  double deg = 0;
  double se_deg = 0;
  Quality quality = Quality::lost;
};

struct Measurement {
  std::optional<Angle> angle;
  bool doubtful = false;
};

struct FilteredRow {
  double t_s = 0;
  std::vector<FilteredAngle> angles;
};

class AngleFilter {
 public:
  explicit AngleFilter(std::size_t angles) : state_(angles) {}

  // One frame in, one out once kLag frames are known. t_s strictly increasing.
  std::optional<FilteredRow> push(double t_s, std::vector<Measurement> measured);
  // At the end: the frames that are still inside.
  std::vector<FilteredRow> flush();

 private:
  using Gauss = Motion<1>;
  struct State {
    std::optional<Gauss> past;  // after the last frame that came out
    double past_s = 0;
    double density = 0;                    // q
    std::size_t missing = kMaxHidden + 1;  // frames without a measurement until then
    double last_deg = 0;
    // Running means over the newest frames.
    double c0 = 0;
    double c1 = 0;
    double variance = 0;
    double weight = 0;
  };
  struct Frame {
    double t_s;
    std::vector<Measurement> measured;
  };

  void learn_noise();
  FilteredRow pop();
  FilteredAngle pop(State& state, std::size_t k);
  std::size_t filter_forward(const State& state, std::size_t k, double factor);
  Gauss smooth_backward() const;
  static double noise_factor(const State& state);
  double density(std::size_t k, double factor) const;

  std::deque<Frame> window_;
  std::vector<State> state_;
  std::vector<Gauss> predicted_;
  std::vector<Gauss> filtered_;
};

}  // namespace flexor::camera
