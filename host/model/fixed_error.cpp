#include "host/model/fixed_error.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "host/model/compensator.hpp"
#include "host/model/lti.hpp"

namespace flexor::model {
namespace {

using Readings = std::vector<double>;

double in_steps(double u) {
  return std::ldexp(std::round(std::ldexp(u, core::kInputFraction)), -core::kInputFraction);
}

// One model in both arithmetics, always given the same readings.
class Pair {
 public:
  explicit Pair(const Model& model) : exact_(model), fixed_(model), deviation_deg_(model.joints.size()) {}

  // Fixed point minus double of each joint after one more sample.
  const std::vector<double>& step(const Readings& u) {
    const auto exact = exact_.step(u);
    const auto fixed = fixed_.step(u);
    for (std::size_t j = 0; j < deviation_deg_.size(); ++j) {
      deviation_deg_[j] = fixed[j].angle_deg - exact[j].angle_deg;
    }
    return deviation_deg_;
  }

 private:
  Compensator<DoubleArithmetic> exact_;
  Compensator<FixedArithmetic> fixed_;
  std::vector<double> deviation_deg_;
};

void take_larger(const std::vector<double>& deviation_deg, std::vector<double>& worst_deg) {
  for (std::size_t j = 0; j < worst_deg.size(); ++j)
    worst_deg[j] = std::max(worst_deg[j], std::abs(deviation_deg[j]));
}

class Search {
 public:
  Search(const Model& model, const ErrorSearch& search)
      : fresh_(model), search_(search), worst_(model.joints.size()), random_(search.seed) {
    // Inside the limits as both arithmetics have them.
    const FixedModel fixed(model);
    for (const std::int16_t low : fixed.valid_min) low_.push_back(std::ldexp(low, -core::kInputFraction));
    for (const std::int16_t high : fixed.valid_max) high_.push_back(std::ldexp(high, -core::kInputFraction));
  }

  std::vector<double> worst() {
    ramps_and_noise();
    for (int k = 0; k < search_.attacks; ++k) {
      attack(k % 2 == 0 ? 1 : -1, static_cast<std::size_t>(k / 2) % worst_.size());
    }
    return worst_;
  }

 private:
  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(random_()) / 4294967296.0;
  }

  template <class At>
  Readings readings(const At& at) {
    Readings out;
    for (std::size_t i = 0; i < low_.size(); ++i) {
      const double u = std::clamp(at(i), low_[i], high_[i]);
      out.push_back(search_.in_steps ? in_steps(u) : u);
    }
    return out;
  }

  void ramps_and_noise() {
    Pair pair = fresh_;
    const auto add = [&](const auto& share) {
      const Readings u = readings([&](std::size_t i) { return low_[i] + (high_[i] - low_[i]) * share(); });
      take_larger(pair.step(u), worst_);
    };
    constexpr int kRamp = 4096;
    for (int k = 0; k <= 2 * kRamp; ++k) {
      add([&] { return static_cast<double>(k <= kRamp ? k : 2 * kRamp - k) / kRamp; });
    }
    for (int k = 0; k < search_.noise; ++k) add([&] { return uniform(0, k / 100 % 2 == 0 ? 1.0 : 0.2); });
  }

  // A few jumps over the whole range, then readings near one another, each the best of a dozen for a deviation of
  // one joint upwards or downwards.
  void attack(double direction, std::size_t joint) {
    constexpr int kJumps = 3;
    constexpr int kLength = 40;
    constexpr int kCandidates = 12;
    constexpr double kNear = 2;
    Pair pair = fresh_;
    Pair best = fresh_;
    Pair next = fresh_;  // assigned to again and again, which takes no memory
    const Readings base = readings([&](std::size_t i) { return uniform(low_[i], high_[i]); });
    for (int k = 0; k < kLength; ++k) {
      double most = -1e300;
      for (int candidate = 0; candidate < kCandidates; ++candidate) {
        next = pair;
        const std::vector<double>& deviation = next.step(readings([&](std::size_t i) {
          return k < kJumps ? uniform(low_[i], high_[i]) : base[i] + uniform(-kNear, kNear);
        }));
        take_larger(deviation, worst_);
        if (direction * deviation[joint] > most) {
          most = direction * deviation[joint];
          std::swap(best, next);
        }
      }
      std::swap(pair, best);
    }
  }

  Pair fresh_;
  ErrorSearch search_;
  std::vector<double> worst_;
  Readings low_;
  Readings high_;
  std::mt19937 random_;
};

}  // namespace

double allowed_fixed_error_deg(const Joint& joint) {
  constexpr double kShare = 0.1;
  return std::max(kFixedError_deg, kShare * joint.accuracy.value_or(Accuracy{}).root_mean_square());
}

std::vector<double> worst_fixed_error_deg(const Model& model, const ErrorSearch& search) {
  return Search(model, search).worst();
}

std::vector<double> fixed_error_deg(const Model& model, const std::vector<Readings>& readings) {
  Pair pair(model);
  std::vector<double> worst(model.joints.size());
  Readings rounded;
  for (const Readings& row : readings) {
    rounded.clear();
    for (const double u : row) rounded.push_back(in_steps(u));
    take_larger(pair.step(rounded), worst);
  }
  return worst;
}

}  // namespace flexor::model
