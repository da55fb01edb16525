#include "host/model/fixed_error.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "host/model/compensator.hpp"

namespace flexor::model {
namespace {

double in_steps(double u) {
  return std::ldexp(std::round(std::ldexp(u, core::kInputFraction)), -core::kInputFraction);
}

// One channel in both arithmetics, always given the same input.
class Pair {
 public:
  Pair(const Channel& channel, double period_s) : Pair(model_of(channel, period_s)) {}

  // Fixed point minus double after one more sample.
  double step(double u) { return fixed_.step(0, u).angle_deg - exact_.step(0, u).angle_deg; }

 private:
  explicit Pair(const Model& model) : exact_(model), fixed_(model) {}

  static Model model_of(const Channel& channel, double period_s) {
    Model model;
    model.sample_period_s = period_s;
    model.channels = {channel};
    return model;
  }

  Compensator<DoubleArithmetic> exact_;
  Compensator<FixedArithmetic> fixed_;
};

class Search {
 public:
  Search(const Channel& channel, double period_s, const ErrorSearch& search)
      : fresh_(channel, period_s),
        search_(search),
        // Inside the limits as both arithmetics have them.
        low_(std::ldexp(std::ceil(std::ldexp(channel.valid_min, core::kInputFraction)),
                        -core::kInputFraction)),
        high_(std::ldexp(std::floor(std::ldexp(channel.valid_max, core::kInputFraction)),
                         -core::kInputFraction)),
        random_(search.seed) {}

  double worst() {
    ramps_and_noise();
    for (int k = 0; k < search_.attacks; ++k) attack(k % 2 == 0 ? 1 : -1);
    return worst_;
  }

 private:
  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(random_()) / 4294967296.0;
  }

  double input(double u) const {
    u = std::clamp(u, low_, high_);
    return search_.in_steps ? in_steps(u) : u;
  }

  void ramps_and_noise() {
    Pair pair = fresh_;
    const auto add = [&](double share) {
      worst_ = std::max(worst_, std::abs(pair.step(input(low_ + (high_ - low_) * share))));
    };
    constexpr int kRamp = 4096;
    for (int k = 0; k <= 2 * kRamp; ++k) add(static_cast<double>(k <= kRamp ? k : 2 * kRamp - k) / kRamp);
    for (int k = 0; k < 20000; ++k) add(uniform(0, k / 100 % 2 == 0 ? 1.0 : 0.2));
  }

  // A few jumps over the whole range, then inputs near one another, each the best of a dozen for a deviation
  // upwards or downwards.
  void attack(double direction) {
    constexpr int kJumps = 3;
    constexpr int kLength = 40;
    constexpr int kCandidates = 12;
    constexpr double kNear = 2;
    Pair pair = fresh_;
    const double base = uniform(low_, high_);
    for (int k = 0; k < kLength; ++k) {
      Pair best = pair;
      double most = -1e300;
      for (int candidate = 0; candidate < kCandidates; ++candidate) {
        Pair next = pair;
        const double deviation =
            direction * next.step(input(k < kJumps ? uniform(low_, high_) : base + uniform(-kNear, kNear)));
        worst_ = std::max(worst_, std::abs(deviation));
        if (deviation > most) {
          most = deviation;
          best = next;
        }
      }
      pair = best;
    }
  }

  Pair fresh_;
  ErrorSearch search_;
  double low_;
  double high_;
  std::mt19937 random_;
  double worst_ = 0;
};

}  // namespace

double worst_fixed_error_deg(const Channel& channel, double period_s, const ErrorSearch& search) {
  return Search(channel, period_s, search).worst();
}

double fixed_error_deg(const Channel& channel, double period_s, const std::vector<double>& inputs) {
  Pair pair(channel, period_s);
  double worst = 0;
  for (const double u : inputs) worst = std::max(worst, std::abs(pair.step(in_steps(u))));
  return worst;
}

}  // namespace flexor::model
