#include "host/recording/sensor_lag.hpp"

#include <Eigen/Dense>
#include <numbers>
#include <random>
#include <span>
#include <unsupported/Eigen/NonLinearOptimization>

#include "host/io/numbers.hpp"
#include "host/recording/resample.hpp"

namespace flexor::recording {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kGrid_hz = 30;
constexpr double kMostRows = 4000;
constexpr Index kLeastRows = 50;
constexpr Index kMostKnots = 10;
constexpr double kReach_s = 1;   // of the offset's search
constexpr double kAtEnd = 0.98;  // of that reach
constexpr double kBefore_s = 1;  // for lag and play to forget what was before the recording
constexpr double kVelocity_s = 0.025;
constexpr double kLeastLeft = 1e-3;
constexpr double kOffset_s = 0.1;
constexpr double kLag_s = 0.06;  // the priors' deviations
constexpr double kPlay_deg = 5;
constexpr double kDrift_ppm = 3000;
constexpr double kHeld = 1e6;
constexpr double kClearErrors = 3;
constexpr double kSmooth_s = 0.08;
constexpr double kFrames = 0.7;  // of their distance, at least: a parabola needs three of them
constexpr double kCreep_s = 5;   // nothing depends on how slow it is
constexpr double kSlope = 1e-3;  // ridge, of the readings' count: where no reading is
constexpr double kOutlier = 6;   // robust deviations
constexpr double kBent = 0.1;    // of the range, from the reading that the sensor rests at
constexpr double kClock_s =
    0.008;  // what frames and rows are stamped by, and what a camera's noise does to a play
constexpr double kNormal = 1.4826;  // standard deviation of a normal distribution, in medians of its sizes
constexpr unsigned kSeed = 2019;
constexpr Index kUnknowns = 4;
constexpr Index kPriors = 5;
constexpr double kDifference = 0.01;
constexpr int kMostTries = 60;

VectorXd play(VectorXd x, double radius) {
  double p = x(0);
  for (double& value : x) value = p = std::min(value + radius, std::max(value - radius, p));
  return x;
}

// H_tau of what is straight between the grid's points, exactly; from rest.
VectorXd lag(VectorXd x, double tau_s) {
  const double keep = tau_s > 0 ? std::exp(-1 / (kGrid_hz * tau_s)) : 0;
  const double ramp = 1 - (1 - keep) * tau_s * kGrid_hz;
  double y = x(0);
  double before = x(0);
  for (double& value : x) {
    y = keep * y + (1 - keep) * before + ramp * (value - before);
    before = value;
    value = y;
  }
  return x;
}

// Velocity per second of what align.hpp smooths the velocities by, so that its product with a difference of angles is the
// time between them.
VectorXd velocity_of(const VectorXd& deg, double span_s) {
  const std::vector<double> twice = derivative_kernel(std::numbers::sqrt2 * smoothing_s(span_s) * kGrid_hz);
  const Index reach = std::ssize(twice) / 2;
  VectorXd kernel = Eigen::Map<const VectorXd>(twice.data(), std::ssize(twice));
  kernel *= kGrid_hz / kernel.dot(VectorXd::LinSpaced(kernel.size(), -static_cast<double>(reach),
                                                      static_cast<double>(reach)));
  VectorXd out = VectorXd::Zero(deg.size());
  for (Index i = reach; i + reach < deg.size(); ++i)
    out(i) = kernel.dot(deg.segment(i - reach, kernel.size()));
  // sum v (K K v) = sum (K v)^2: the denominator of the shift that maps one velocity's integral onto the other.
  VectorXd speed = VectorXd::Zero(deg.size());
  speed.segment(1, deg.size() - 2) = kGrid_hz / 2 * (deg.tail(deg.size() - 2) - deg.head(deg.size() - 2));
  // Bends much quicker than the smoothing leave nothing of their velocity, which then tells nothing.
  const double left = out.dot(speed);
  return left > kLeastLeft * speed.squaredNorm() ? VectorXd(out / left) : VectorXd::Zero(deg.size());
}

// Of the frames around each of these instants a parabola, weighted by a Gaussian: it takes out a camera's noise, which a lag
// would be fitted to, since it takes it out as well, and unlike a mean it does not round the motion off as a lag does.
VectorXd smooth(const Series& series, const std::vector<double>& at_s) {
  const Range range = without_spikes(series.value);
  const double width_s = std::max(
      kSmooth_s, kFrames * (series.t_s.back() - series.t_s.front()) / static_cast<double>(series.t_s.size()));
  VectorXd out(std::ssize(at_s));
  std::size_t begin = 0;
  for (std::size_t k = 0; k < at_s.size(); ++k) {
    while (begin + 1 < series.t_s.size() && series.t_s[begin] < at_s[k] - 3 * width_s) ++begin;
    Eigen::Matrix3d gram = 1e-6 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double nearest = series.value[begin];
    for (std::size_t i = begin; i < series.t_s.size(); ++i) {
      const double z = (series.t_s[i] - at_s[k]) / width_s;
      if (z > 3 && i > begin) break;
      const Eigen::Vector3d parabola(1, z, z * z);
      const double weight = std::exp(-z * z / 2);
      gram += weight * parabola * parabola.transpose();
      right += weight * (std::clamp(series.value[i], range.min, range.max) - nearest) * parabola;
    }
    out(static_cast<Index>(k)) = nearest + gram.ldlt().solve(right)(0);
  }
  return out;
}

// Standard deviation of the frames' white noise: third differences of motion are small beside those of noise. The median of
// their sizes, since a few movements are quick.
double noise_of(const std::span<const double> x) {
  std::vector<double> third;
  for (std::size_t k = 3; k < x.size(); ++k)
    third.push_back(std::abs(x[k] - 3 * x[k - 1] + 3 * x[k - 2] - x[k - 3]));
  return third.empty() ? 0 : kNormal * io::median(std::move(third)) / std::sqrt(20);
}

// One angle on an even grid, from the first frame on.
struct Angle {
  double start_s;
  VectorXd deg;
  VectorXd noisy;     // with as much noise once more
  double noise = 0;   // mean square of that
  VectorXd crept;     // where it was lately, in units of its spread
  VectorXd velocity;  // smoothed twice, over the square of what is smoothed once
  std::vector<std::uint8_t> good;

  Angle(const Series& series) : start_s(series.t_s.front()) {
    const auto n = static_cast<std::size_t>((series.t_s.back() - start_s) * kGrid_hz) + 1;
    std::vector<double> t(n);
    for (std::size_t k = 0; k < n; ++k) t[k] = start_s + static_cast<double>(k) / kGrid_hz;
    deg = smooth(series, t);
    std::mt19937 random(kSeed);
    Index farthest = 0;
    (deg.array() - deg.mean()).abs().maxCoeff(&farthest);
    const double sign = deg(farthest) > deg.mean() ? 1 : -1;  // of the angle: turned over, all turns over
    std::normal_distribution<double> normal(0, noise_of(series.value));
    std::vector<double> more(series.value.begin(), series.value.end());
    for (double& value : more) value += sign * normal(random);
    noisy = smooth({series.t_s, more}, t);
    noise = (noisy - deg).squaredNorm() / static_cast<double>(n);
    const double max_gap_s = default_max_gap_s(series.t_s);
    std::size_t next = 1;
    for (const double now : t) {
      while (next + 1 < series.t_s.size() && series.t_s[next] < now) ++next;
      good.push_back(series.t_s[next] - series.t_s[next - 1] <= max_gap_s);
    }
    crept = lag(deg, kCreep_s);
    crept.array() -= crept.mean();
    crept /= std::max(1e-9, crept.norm() / std::sqrt(static_cast<double>(n)));
    velocity = velocity_of(deg, static_cast<double>(n) / kGrid_hz);
  }

  bool sees(double t_s) const {
    const double at = (t_s - start_s) * kGrid_hz;
    return at >= 0 && at + 1 < static_cast<double>(deg.size()) && good[static_cast<std::size_t>(at)];
  }
};

enum class Last { lag, play };

// What is fitted: z = (offset from near_s in tenths of a second, then radius, lag and drift in deviations of their priors).
struct Point {
  VectorXd z = VectorXd::Zero(kUnknowns);
  Last last = Last::lag;

  double offset_s() const { return kOffset_s * z(0); }
  double play_deg() const { return kPlay_deg * std::abs(z(1)); }
  double lag_s() const { return kLag_s * std::abs(z(2)); }
  double drift() const { return 1e-6 * kDrift_ppm * z(3); }
};

class SensorModel {
 public:
  SensorModel(const Series& sensor, const std::vector<Series>& angles, double near_s) {
    for (const Series& angle : angles) angles_.emplace_back(angle);
    const Range range = without_spikes(sensor.value);
    double span_s = sensor.t_s.back() - sensor.t_s.front();
    for (const Angle& a : angles_) span_s = std::min(span_s, static_cast<double>(a.deg.size()) / kGrid_hz);
    reach_s_ = std::min(kReach_s, span_s / 10);
    const auto every =
        static_cast<std::size_t>(std::ceil(static_cast<double>(sensor.t_s.size()) / kMostRows));
    std::vector<double> value;
    for (std::size_t i = 0; i < sensor.t_s.size(); i += every) {
      const double t = sensor.t_s[i] + near_s;
      const bool seen = std::ranges::all_of(angles_, [&](const Angle& a) {
        return a.sees(t) && a.sees(t - reach_s_ - std::min(kBefore_s, reach_s_)) && a.sees(t + reach_s_);
      });
      if (!seen || sensor.value[i] < range.min || sensor.value[i] > range.max) continue;
      t_s_.push_back(t);
      value.push_back(sensor.value[i]);
    }
    if (!t_s_.empty()) middle_s_ = (t_s_.front() + t_s_.back()) / 2;
    reading_ = Eigen::Map<const VectorXd>(value.data(), std::ssize(value));
    counts_ = VectorXd::Ones(reading_.size());
    if (rows() >= kLeastRows) slope_ = slopes();
    knots_ = std::clamp<Index>(static_cast<Index>(std::sqrt(reading_.size()) / 3), 3, kMostKnots);
  }

  Index rows() const { return reading_.size(); }
  double reach_s() const { return reach_s_; }
  // The offset, less how much later than the angles their bends move by the velocities; zero where none tells.
  double velocity_miss_s(const Point& at) const {
    double sum = 0;
    double count = 0;
    for (const Angle& angle : angles_) {
      if (angle.velocity.isZero()) continue;
      sum += (angle.deg - bend(at, angle.deg)).dot(angle.velocity);
      ++count;
    }
    return count > 0 ? at.offset_s() - sum / count : 0;
  }

  // Readings minus the best f of this offset, play and lag; zero where a reading does not count.
  VectorXd residuals(const Point& at) const {
    const std::vector<Term> terms = terms_of(at);
    const std::size_t of_row = 3 * angles_.size();
    const Index columns = (knots_ + 1) * std::ssize(angles_);
    MatrixXd gram = MatrixXd::Zero(columns, columns);
    gram.diagonal().setConstant(kSlope * static_cast<double>(rows()));
    VectorXd right = VectorXd::Zero(columns);
    const VectorXd about_mean = reading_.array() - reading_.mean();
    for (Index i = 0; i < rows(); ++i) {
      const std::span row(&terms[static_cast<std::size_t>(i) * of_row], of_row);
      for (const Term& a : row) {
        const double weighted = counts_(i) * a.value;
        right(a.column) += weighted * about_mean(i);
        for (const Term& b : row) gram(a.column, b.column) += weighted * b.value;
      }
    }
    const VectorXd c = gram.ldlt().solve(right);
    VectorXd out = about_mean;
    for (Index i = 0; i < rows(); ++i)
      for (const Term& a : std::span(&terms[static_cast<std::size_t>(i) * of_row], of_row))
        out(i) -= a.value * c(a.column);
    out = out.cwiseProduct(counts_);
    return out * std::sqrt(1 + taken_out(at) / std::max(1e-9, out.squaredNorm()));
  }

  void count_all() { counts_.setOnes(); }

  void leave_out_outliers(const Point& at) {
    const VectorXd e = residuals(at).cwiseAbs();
    const double rest = io::median({reading_.begin(), reading_.end()});
    const double range = reading_.maxCoeff() - reading_.minCoeff();
    std::vector<double> bent;  // most of the time a finger may rest, where residuals are small
    for (Index i = 0; i < rows(); ++i)
      if (std::abs(reading_(i) - rest) > kBent * range) bent.push_back(e(i));
    const double deviation =
        kNormal * std::max(io::median({e.begin(), e.end()}), bent.empty() ? 0 : io::median(bent));
    if (deviation > 0) counts_ = (e.array() <= kOutlier * deviation).cast<double>();
  }

 private:
  // An entry of a reading's row: the two knots beside each angle, and where that angle was lately.
  struct Term {
    Index column;
    double value;
  };

  std::vector<Term> terms_of(const Point& at) const {
    std::vector<Term> out(static_cast<std::size_t>(rows()) * 3 * angles_.size());
    for (Index j = 0; j < std::ssize(angles_); ++j) {
      const Angle& angle = angles_[static_cast<std::size_t>(j)];
      const VectorXd x = bend(at, angle.deg);
      const double low = x.minCoeff();
      const double step = std::max(x.maxCoeff() - low, 1e-9) / static_cast<double>(knots_ - 1);
      const VectorXd knot = (at_readings(at, x, j).array() - low) / step;
      const VectorXd crept = at_readings(at, angle.crept, j);
      for (Index i = 0; i < rows(); ++i) {
        const Index below = std::min<Index>(static_cast<Index>(knot(i)), knots_ - 2);
        const double share = knot(i) - static_cast<double>(below);
        Term* term = &out[static_cast<std::size_t>(3 * (i * std::ssize(angles_) + j))];
        term[0] = {j * knots_ + below, 1 - share};
        term[1] = {j * knots_ + below + 1, share};
        term[2] = {knots_ * std::ssize(angles_) + j, crept(i)};
      }
    }
    return out;
  }

  // Counts a degree, of a straight line.
  VectorXd slopes() const {
    MatrixXd line(rows(), 1 + std::ssize(angles_));
    line.col(0).setOnes();
    for (Index j = 0; j < std::ssize(angles_); ++j)
      line.col(1 + j) = at_readings({}, angles_[static_cast<std::size_t>(j)].deg, j);
    return line.colPivHouseholderQr().solve(reading_).tail(std::ssize(angles_));
  }

  static VectorXd bend(const Point& at, const VectorXd& angle) {
    return at.last == Last::lag ? lag(play(angle, at.play_deg()), at.lag_s())
                                : play(lag(angle, at.lag_s()), at.play_deg());
  }

  // The squares of the camera's noise that lag and play take out of the residuals: they explain nothing by that.
  double taken_out(const Point& at) const {
    double out = 0;
    for (std::size_t j = 0; j < angles_.size(); ++j) {
      const Angle& angle = angles_[j];
      const double left =
          (bend(at, angle.noisy) - bend(at, angle.deg)).squaredNorm() / static_cast<double>(angle.deg.size());
      out +=
          slope_(static_cast<Index>(j)) * slope_(static_cast<Index>(j)) * std::max(0.0, angle.noise - left);
    }
    return out * counts_.sum();
  }

  // Of angle j's grid, at the readings.
  VectorXd at_readings(const Point& at, const VectorXd& x, Index j) const {
    VectorXd out(rows());
    for (Index i = 0; i < rows(); ++i) {
      const double t = (t_s_[static_cast<std::size_t>(i)] + at.offset_s() +
                        at.drift() * (t_s_[static_cast<std::size_t>(i)] - middle_s_) -
                        angles_[static_cast<std::size_t>(j)].start_s) *
                       kGrid_hz;
      const Index k = std::clamp<Index>(static_cast<Index>(t), 0, x.size() - 2);
      out(i) = x(k) + std::clamp(t - static_cast<double>(k), 0.0, 1.0) * (x(k + 1) - x(k));
    }
    return out;
  }

  std::vector<Angle> angles_;
  std::vector<double> t_s_;  // of the readings, on the angles' clock if near_s is right
  VectorXd reading_;
  VectorXd slope_;
  VectorXd counts_;
  double reach_s_ = 0;
  double middle_s_ = 0;  // of t_s_, where the drift is zero
  Index knots_ = 0;
};

// 1 + 2 sum_k rho_k.
double correlation_sum(const VectorXd& e) {
  const double square = e.squaredNorm();
  const auto rho = [&](Index k) { return e.head(e.size() - k).dot(e.tail(e.size() - k)) / square; };
  double sum = 1;
  for (Index k = 1; k + 1 < e.size() / 2; k += 2) {
    const double pair = rho(k) + rho(k + 1);
    if (!(pair > 0)) break;
    sum += 2 * pair;
  }
  return sum;
}

// One over the residuals' deviation, times the share of them that is independent.
double weight_of(const VectorXd& e) {
  const double square = e.squaredNorm();
  return square > 0 ? std::sqrt(static_cast<double>(e.size()) / square / correlation_sum(e)) : 1;
}

// Weighted residuals and what the priors say, for Eigen's Levenberg-Marquardt.
struct Posterior {
  using Scalar = double;
  using InputType = VectorXd;
  using ValueType = VectorXd;
  using JacobianType = MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const SensorModel& model;
  Last last;
  double weight;
  bool drifts;  // otherwise it is held at zero

  Index inputs() const { return kUnknowns; }
  Index values() const { return model.rows() + kPriors; }
  int df(const VectorXd& z, MatrixXd& slope) const {
    VectorXd f(values());
    VectorXd moved(values());
    (*this)(z, f);
    for (Index k = 0; k < inputs(); ++k) {
      VectorXd to = z;
      to(k) += kDifference;
      (*this)(to, moved);
      slope.col(k) = (moved - f) / kDifference;
    }
    return 0;
  }
  int operator()(const VectorXd& z, VectorXd& f) const {
    f.head(model.rows()) = weight * model.residuals({z, last});
    f(model.rows()) = z(1);
    f(model.rows() + 1) = z(2);
    const Point at{z, last};
    f(model.rows() + 3) = model.velocity_miss_s(at) / kVelocity_s;
    f(model.rows() + 4) = (drifts ? 1 : kHeld) * z(3);
    // Beyond the reach there is nothing to look at.
    f(model.rows() + 2) = 100 * std::max(0.0, std::abs(z(0)) * kOffset_s / model.reach_s() - 1);
    return 0;
  }
};

struct Minimum {
  Point at;
  double loss;
};

const Minimum& better(const Minimum& a, const Minimum& b) { return b.loss < a.loss ? b : a; }

Minimum descend(const SensorModel& model, Point from, double weight, bool drifts) {
  Posterior posterior{model, from.last, weight, drifts};
  Eigen::LevenbergMarquardt<Posterior> search(posterior);
  search.parameters.maxfev = kMostTries;
  search.parameters.ftol = search.parameters.xtol = 1e-6;
  search.minimize(from.z);
  return {from, search.fvec.squaredNorm()};
}

// Of unknown k, in units of z: by the curvature of the loss, and by the sum of what each residual moves it by, as
// correlated as these are. The first is too wide where the noise comes in runs, the second too narrow; the mean of their
// squares is neither.
double error(const SensorModel& model, const Point& at, double weight, Index k) {
  const Posterior posterior{model, at.last, weight, true};
  VectorXd f(posterior.values());
  MatrixXd slope(posterior.values(), posterior.inputs());
  posterior(at.z, f);
  posterior.df(at.z, slope);
  const MatrixXd covariance = (slope.transpose() * slope).inverse();
  const Eigen::RowVectorXd row = covariance.row(k);
  const VectorXd readings =
      (slope.topRows(model.rows()) * row.transpose()).cwiseProduct(f.head(model.rows()));
  const VectorXd priors = slope.bottomRows(kPriors) * row.transpose();
  const double summed = readings.squaredNorm() * correlation_sum(readings) + priors.squaredNorm();
  return std::sqrt((covariance(k, k) + summed) / 2);
}

// Of three starts the best; the noise as the first leaves it.
Minimum search(SensorModel& model, double near_ppm, bool drifts) {
  const auto start = [&](double offset_s, double play_deg, double lag_s) {
    Point out;
    out.z << offset_s / kOffset_s, play_deg / kPlay_deg, lag_s / kLag_s, drifts ? near_ppm / kDrift_ppm : 0;
    return out;
  };
  model.count_all();
  const Point small = start(0, 0.5, 0.002);
  const Point large = start(0.1, 2, 0.2);
  Minimum best = descend(model, small, weight_of(model.residuals(start(0, 0, 0))), drifts);
  model.leave_out_outliers(best.at);
  const double weight = weight_of(model.residuals(best.at));
  best = better(descend(model, best.at, weight, drifts), descend(model, large, weight, drifts));
  best = better(best, descend(model, {best.at.z, Last::play}, weight, drifts));
  return descend(model, best.at, weight_of(model.residuals(best.at)), drifts);
}

}  // namespace

std::optional<SensorLag> sensor_lag(const Series& sensor, const std::vector<Series>& angles, double near_s,
                                    std::optional<double> near_ppm) {
  SensorModel model(sensor, angles, near_s);
  if (model.rows() < kLeastRows) return std::nullopt;
  SensorLag out;
  Minimum best = search(model, 0, false);
  double weight = weight_of(model.residuals(best.at));
  if (near_ppm) {
    Point from = best.at;
    from.z(3) = *near_ppm / kDrift_ppm;
    Minimum drifting = descend(model, from, weight, true);
    const auto measure = [&] {
      out.drift_ppm = 1e6 * drifting.at.drift();
      out.drift_se_ppm = kDrift_ppm * error(model, drifting.at, weight, 3);
    };
    measure();
    if (is_clear(out.drift_ppm, out.drift_se_ppm)) {
      best = drifting = search(model, *near_ppm, true);
      weight = weight_of(model.residuals(best.at));
      measure();
    }
  }
  out.clock_offset_s = near_s + best.at.offset_s();
  out.standard_error_s = std::hypot(kOffset_s * error(model, best.at, weight, 0), kClock_s);
  // An offset at the end of its search lies anywhere beyond.
  if (std::abs(best.at.offset_s()) > kAtEnd * model.reach_s())
    out.standard_error_s = std::max(out.standard_error_s, model.reach_s());
  out.lag_s = best.at.lag_s();
  out.play_deg = best.at.play_deg();
  return out;
}

bool is_clear(double drift_ppm, double standard_error_ppm) {
  return std::abs(drift_ppm) > kClearErrors * standard_error_ppm;
}

}  // namespace flexor::recording
