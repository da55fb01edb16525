// Models for tests as a glove has them: counts of 0 to 1023 in, angles out, with coefficients that a hand could
// need. Drawn from a seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host/model/random_model.hpp"

namespace flexor::model {

inline constexpr double kMaxCount = 1023;

class RandomGlove : Draw {
 public:
  explicit RandomGlove(unsigned seed) : Draw(seed) {}

  // One joint from one sensor, with this kind (its place in Kind) before or behind the step to degrees; a sum
  // takes three sensors.
  Model make_with(std::size_t kind) {
    // A bank of plays takes the ends of a range past it: counts to 1023 leave it no room in Q5.
    const bool first = kind != Kind(Hysteresis{}).index() && coin();
    start(1);
    std::string signal = first ? model_.inputs[0].name : degrees(model_.inputs[0].name);
    const double top = first ? kMaxCount : 90;
    if (kind == kSum) {
      signal = sum({degrees("s0"), degrees("s0"), signal_of("s0", Gain{top / 900, 3})});
    } else {
      const bool now_degrees = !first || turns_to_degrees(kind);
      signal = signal_of(signal, of_kind(kind, first));
      if (!now_degrees) signal = signal_of(signal, Gain{90 / kMaxCount, uniform(-5, 5)});
    }
    joint("index", signal);
    return model_;
  }

  // Several sensors; joints of several of them, and joints that follow others.
  Model make() {
    start(1 + below(4));
    std::vector<std::string> angles;
    for (const Input& input : model_.inputs) {
      std::string signal = input.name;
      for (int n = below(3); n > 0; --n) signal = signal_of(signal, of_kind(any_of(kOfCounts), true));
      signal = degrees(signal);
      for (int n = below(2); n > 0; --n) signal = signal_of(signal, of_kind(any_of(kOfDegrees), false));
      angles.push_back(signal);
    }
    const int joints = 1 + below(4);
    for (int j = 0; j < joints; ++j) {
      std::string signal = angles[static_cast<std::size_t>(below(static_cast<int>(angles.size())))];
      if (coin()) signal = sum({signal, angles.front(), angles.back()});
      if (coin()) signal = signal_of(signal, of_kind(any_of(kDynamics), false));
      if (j > 0 && coin())
        signal = signal_of(model_.joints.back().from, Gain{uniform(0.3, 0.8), uniform(-5, 5)});
      joint(fmt::format("joint_{}", j), signal);
    }
    return model_;
  }

  // A walk with jumps and stops, in whole counts.
  std::vector<std::vector<double>> readings(std::size_t count) {
    std::vector<double> u(model_.inputs.size(), 500);
    std::vector<std::vector<double>> out;
    for (std::size_t k = 0; k < count; ++k) {
      const int how = below(40);
      for (double& one : u) {
        if (how == 0) one = uniform(0, kMaxCount);
        if (how > 0 && how < 30) one += uniform(-60, 60);
        one = std::round(std::clamp(one, 0.0, kMaxCount));
      }
      out.push_back(u);
    }
    return out;
  }

 private:
  inline static const std::size_t kSum = Kind(Sum{}).index();
  inline static const std::vector<Kind> kOfCounts = {DeadZone{}, Play{}};
  inline static const std::vector<Kind> kToDegrees = {Gain{}, Curve{}, Lti{}};
  inline static const std::vector<Kind> kPlain = {Gain{}, Curve{}};
  inline static const std::vector<Kind> kOfDegrees = {Gain{}, DeadZone{},   Curve{},
                                                      Play{}, Hysteresis{}, Saturation{}};
  inline static const std::vector<Kind> kDynamics = {Lag{}, Lti{}, PolePair{}};

  static bool turns_to_degrees(std::size_t kind) {
    return std::ranges::any_of(kToDegrees, [&](const Kind& one) { return one.index() == kind; });
  }
  std::size_t any_of(const std::vector<Kind>& kinds) {
    return kinds[static_cast<std::size_t>(below(static_cast<int>(kinds.size())))].index();
  }

  void start(int sensors) {
    model_ = {};
    model_.sample_period_s = uniform(0.01, 0.1);
    for (int i = 0; i < sensors; ++i)
      model_.inputs.push_back({fmt::format("s{}", i), "", "count", "", 0, kMaxCount});
  }
  std::string signal_of(const std::string& from, const Kind& kind) {
    const std::string to = fmt::format("v{}", model_.blocks.size());
    model_.blocks.push_back({{from}, to, kind});
    return to;
  }
  std::string degrees(const std::string& counts) { return signal_of(counts, of_kind(any_of(kPlain), true)); }
  std::string sum(const std::vector<std::string>& from) {
    const std::string to = fmt::format("v{}", model_.blocks.size());
    model_.blocks.push_back(
        {from, to, Sum{{uniform(0.2, 0.8), uniform(-0.3, 0.3), uniform(0, 0.3)}, uniform(-10, 10)}});
    return to;
  }
  void joint(const std::string& name, const std::string& signal) {
    model_.joints.push_back({name, signal_of(signal, Saturation{-uniform(0, 30), uniform(80, 170)}), 10});
  }

  // For a signal in counts or, else, in degrees.
  Kind of_kind(std::size_t kind, bool counts) {
    const double top = counts ? kMaxCount : 90;
    if (kind == Kind(Gain{}).index()) return Gain{uniform(0.5, 1.2) * 90 / top, uniform(-10, 10)};
    if (kind == Kind(DeadZone{}).index()) return DeadZone{-steps(0.02 * top), steps(0.1 * top)};
    if (kind == Kind(Curve{}).index()) return Curve{knots(top), ordinates()};
    if (kind == Kind(Play{}).index()) return Play{uniform(0, 0.04) * top};
    if (kind == Kind(Hysteresis{}).index())
      return Hysteresis{{uniform(0, 0.02) * top, uniform(0, 0.05) * top},
                        {uniform(-0.5, 0.5), uniform(-0.5, 0.5)}};
    if (kind == Kind(Lti{}).index()) return lti(90 / top);
    if (kind == Kind(Lag{}).index()) return Lag{uniform(0.2, 40)};
    if (kind == Kind(PolePair{}).index())
      return PolePair{uniform(3, 40), uniform(0.2, 0.99), {uniform(-0.3, 0.3), uniform(-0.3, 0.3)}};
    return Saturation{-uniform(0, 20), uniform(60, 120)};
  }
  Kind lti(double scale) {
    Lti out{uniform(0.5, 1.2) * scale, coin() ? 0 : uniform(-10, 10), {}, {}};
    for (int n = below(4); n > 0; --n) out.poles_rad_s.push_back(-uniform(0.5, 60));
    if (coin()) {
      for (std::size_t i = 0; i < out.poles_rad_s.size(); ++i) out.taps.push_back(uniform(-0.3, 0.3));
    }
    return out;
  }
  static constexpr int kKnots = 6;
  std::vector<double> knots(double top) {
    std::vector<double> x;
    for (int i = 0; i < kKnots; ++i) {
      x.push_back(top * i / (kKnots - 1) + (i > 0 && i + 1 < kKnots ? uniform(-0.03, 0.03) * top : 0));
    }
    return x;
  }
  std::vector<double> ordinates() {
    std::vector<double> y = {uniform(-5, 5)};
    for (int i = 1; i < kKnots; ++i) y.push_back(y.back() + uniform(12, 22));
    return y;
  }

  // 0 to `most`, in the steps of an input in fixed point.
  double steps(double most) { return std::round(uniform(0, most) * 32) / 32; }
};

}  // namespace flexor::model
