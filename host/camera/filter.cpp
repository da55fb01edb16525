#include "host/camera/filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace flexor::camera {
namespace {

constexpr double kLeastDensity = 20;  // deg^2/s^3
constexpr double kForget = 0.7;       // of an earlier, larger density, a frame
constexpr double kUnknownRate = 1e6;  // variance of the rate at the first measurement, (deg/s)^2
constexpr double kUnknown_deg = 180;
constexpr std::size_t kDifferences = 8;  // that one estimate of the density is made of
constexpr double kNewNoise = 0.03;    // weight of the newest frame among those that the noise is learnt from
constexpr double kFarthest = 5;       // standard deviations
constexpr double kClearlyMore = 1.5;  // variance that the marks did not announce

}  // namespace

std::optional<FilteredRow> AngleFilter::push(double t_s, std::vector<Measurement> measured) {
  window_.push_back({t_s, std::move(measured)});
  learn_noise();
  if (window_.size() <= kLag) return std::nullopt;
  return pop();
}

// From the newest four frames, if they are as far apart as each other.
void AngleFilter::learn_noise() {
  const std::size_t n = window_.size();
  if (n < 4) return;
  const double h = window_[n - 1].t_s - window_[n - 2].t_s;
  for (std::size_t i = n - 3; i < n; ++i) {
    if (std::abs(window_[i].t_s - window_[i - 1].t_s - h) > 0.2 * h) return;
  }
  for (std::size_t k = 0; k < state_.size(); ++k) {
    std::array<double, 4> z{};
    double variance = 0;
    bool all = true;
    for (std::size_t i = 0; i < 4 && all; ++i) {
      const Measurement& m = window_[n - 4 + i].measured[k];
      all = m.angle && !m.doubtful;
      if (!all) break;
      z[i] = m.angle->deg;
      variance += m.angle->variance_deg2 / 4;
    }
    if (!all) continue;
    State& s = state_[k];
    // A jump is no noise: it counts as far as noise could go.
    const double limit = kFarthest * std::sqrt(6 * noise_factor(s) * variance);
    const double older = std::clamp(z[0] - 2 * z[1] + z[2], -limit, limit);
    const double newer = std::clamp(z[1] - 2 * z[2] + z[3], -limit, limit);
    const double share = std::max(kNewNoise, 1 / (s.weight + 1));
    s.weight += 1;
    s.c0 += share * (newer * newer - s.c0);
    s.c1 += share * (older * newer - s.c1);
    s.variance += share * (variance - s.variance);
  }
}

// By which the announced variances are multiplied.
double AngleFilter::noise_factor(const State& s) {
  constexpr double kEnough = 20;
  if (s.weight < kEnough || !(s.variance > 0)) return 1;
  const double motion = std::max(0.0, (4 * s.c0 + 6 * s.c1) * 3 / 11);
  const double seen = (s.c0 - motion * 2 / 3) / 6;
  return seen > kClearlyMore * s.variance ? seen / s.variance : 1;
}

std::vector<FilteredRow> AngleFilter::flush() {
  std::vector<FilteredRow> out;
  while (!window_.empty()) out.push_back(pop());
  return out;
}

FilteredRow AngleFilter::pop() {
  FilteredRow out;
  out.t_s = window_.front().t_s;
  for (std::size_t k = 0; k < state_.size(); ++k) out.angles.push_back(pop(state_[k], k));
  window_.pop_front();
  return out;
}

// The change of rate between three frames in which it was measured is q (h1 + h2) / 3 of motion, the rest
// noise.
double AngleFilter::density(std::size_t k, double factor) const {
  struct Reading {
    double t_s;
    Angle angle;
  };
  std::array<Reading, kDifferences + 2> last{};  // the newest, oldest first
  std::array<double, kDifferences> excess{};
  std::size_t seen = 0;
  double largest = 0;
  for (const Frame& frame : window_) {
    const std::optional<Angle>& z = frame.measured[k].angle;
    if (!z) continue;
    std::shift_left(last.begin(), last.end(), 1);
    last.back() = {frame.t_s, *z};
    if (++seen < 3) continue;
    const Reading& a = last[kDifferences - 1];
    const Reading& b = last[kDifferences];
    const Reading& c = last[kDifferences + 1];
    const double h1 = b.t_s - a.t_s;
    const double h2 = c.t_s - b.t_s;
    const double change = (c.angle.deg - b.angle.deg) / h2 - (b.angle.deg - a.angle.deg) / h1;
    const double between = 1 / h1 + 1 / h2;
    const double noise =
        factor * (a.angle.variance_deg2 / (h1 * h1) + b.angle.variance_deg2 * between * between +
                  c.angle.variance_deg2 / (h2 * h2));
    std::shift_left(excess.begin(), excess.end(), 1);
    excess.back() = 3 * (change * change - noise) / (h1 + h2);
    const std::size_t count = std::min(seen - 2, kDifferences);
    double sum = 0;
    for (std::size_t j = kDifferences - count; j < kDifferences; ++j) sum += excess[j];
    // Fewer than all of them count as if the others had been zero.
    largest = std::max(largest, sum / static_cast<double>(kDifferences));
  }
  return largest;
}

// Kalman's filter over the window; from which frame on it knows anything.
std::size_t AngleFilter::filter_forward(const State& state, std::size_t k, double factor) {
  const double q = state.density;
  const std::size_t n = window_.size();
  predicted_.assign(n, {});
  filtered_.assign(n, {});
  std::optional<Gauss> x = state.past;
  double t = state.past_s;
  std::size_t first = n;  // frame from which on the filter knows anything
  for (std::size_t i = 0; i < n; ++i) {
    const auto& z = window_[i].measured[k].angle;
    if (!x) {
      if (!z) continue;
      x = predicted_[i] =
          Gauss{{z->deg, 0}, Eigen::Vector2d(factor * z->variance_deg2, kUnknownRate).asDiagonal()};
    } else {
      x = predicted_[i] = x->after(window_[i].t_s - t, q);
      if (z) x->update(Gauss::Place(z->deg), factor * z->variance_deg2);
    }
    filtered_[i] = *x;
    t = window_[i].t_s;
    first = std::min(first, i);
  }
  return first;
}

// Rauch, Tung and Striebel's smoother, from the window's newest frame to its oldest.
AngleFilter::Gauss AngleFilter::smooth_backward() const {
  const std::size_t n = window_.size();
  Gauss s = filtered_[n - 1];
  for (std::size_t i = n - 1; i-- > 0;) {
    const Gauss& f = filtered_[i];
    const Gauss& p = predicted_[i + 1];
    const Eigen::Matrix2d step = Gauss::step(window_[i + 1].t_s - window_[i].t_s);
    const Eigen::Matrix2d c = f.covariance * step.transpose() * p.covariance.inverse();
    s = {f.state + c * (s.state - p.state), f.covariance + c * (s.covariance - p.covariance) * c.transpose()};
  }
  return s;
}

FilteredAngle AngleFilter::pop(State& state, std::size_t k) {
  const double factor = noise_factor(state);
  state.density = std::max({kLeastDensity, kForget * state.density, density(k, factor)});
  const std::size_t n = window_.size();
  const std::size_t first = filter_forward(state, k, factor);
  const Measurement& now = window_.front().measured[k];
  state.missing = now.angle ? 0 : state.missing + 1;
  std::size_t run = state.missing;
  for (std::size_t i = 1; !now.angle && i < n && !window_[i].measured[k].angle; ++i) ++run;
  FilteredAngle out;
  if (first == 0) {
    state.past = filtered_[0];
    state.past_s = window_.front().t_s;
  }
  if (first > 0 || run > kMaxHidden) {
    // What was before a long absence means nothing for what comes after it.
    if (run > kMaxHidden) state.past.reset();
    return {state.last_deg, kUnknown_deg, Quality::lost};
  }
  const Gauss s = smooth_backward();
  state.last_deg = out.deg = s.state(0);
  out.se_deg = std::min(kUnknown_deg, std::sqrt(std::max(s.covariance(0, 0), 0.0)));
  out.quality = !now.angle ? Quality::hidden : now.doubtful ? Quality::doubtful : Quality::good;
  return out;
}

}  // namespace flexor::camera
