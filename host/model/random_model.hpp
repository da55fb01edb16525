// Models for tests: any graph that the document allows, drawn from a seed; numbers often lie on their very
// bounds.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

class Draw {
 protected:
  explicit Draw(unsigned seed) : random_(seed) {}
  bool coin() { return below(2) == 0; }
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  std::mt19937 random_;
  Model model_;
};

class RandomModel : Draw {
 public:
  explicit RandomModel(unsigned seed) : Draw(seed) {}

  Model make() {
    model_ = {};
    signals_.clear();
    model_.name = "random \"model\"\n\xc3\xa9";
    model_.written_by = "test";
    model_.sample_period_s = wide(kMinPeriod_s, kMaxPeriod_s);
    if (coin()) model_.max_gap_s = uniform(0, 10);
    for (int n = 1 + below(3); n > 0; --n) add_input();
    for (int n = below(12); n > 0; --n) add_any_block();
    std::vector<std::string> names = {"thumb_cmc", "index", "index_pip", "wrist", "pinky_mcp"};
    std::ranges::shuffle(names, random_);
    names.resize(1 + static_cast<std::size_t>(below(5)));
    for (const std::string& name : names) add_joint(name);
    model_.training = {{"split", uniform(0, 1)}, {"files", {"a.csv", "b.csv"}}};
    return model_;
  }

 private:
  // Any, for a signal with these values.
  Kind kind(const Interval& in) {
    // Of signals in farad, volt, count or ohm; a block may have swallowed all of it.
    const double largest = std::max(in.magnitude(), 1e-12);
    const Kind all[] = {
        Gain{sign() * std::min(wide(1e-3, 1e3), kMaxSignal / largest), sign() * uniform(0, largest)},
        dead_zone(largest),
        Curve{knots(largest), ordinates()},
        Play{coin() ? 0 : uniform(0, largest)},
        hysteresis(largest),
        lti(largest),
        Lag{rate(kMinPoleTimesPeriod)},
        PolePair{rate(1e-4), coin() ? uniform(0.01, 0.999) : 0.01, {tap(), tap()}},
        Saturation{-angle_size(), angle_size()},
        sum()};
    static_assert(std::size(all) == std::variant_size_v<Kind>, "each kind");
    return all[below(static_cast<int>(std::size(all)))];
  }

  void add_input() {
    Input input;
    input.name = fmt::format("Sensor \\ {}", model_.inputs.size());
    input.column = coin() ? "a \"b\"" : "";
    input.unit = coin() ? "count" : "";
    input.strip = coin() ? "ring" : "";
    const double largest = wide(1e-12, kMaxSignal);
    input.valid_min = coin() ? 0 : uniform(-largest, largest / 2);
    input.valid_max =
        coin() ? largest : std::max(uniform(largest / 2, largest), input.valid_min + 1e-3 * largest);
    model_.inputs.push_back(input);
    signals_.push_back({input.name, {input.valid_min, input.valid_max}});
  }

  // A block that would take valid readings past the bounds is drawn again; a play never does.
  void add_any_block() {
    const auto from = static_cast<std::size_t>(below(static_cast<int>(signals_.size())));
    for (int attempt = 0; attempt < 10; ++attempt) {
      const Kind drawn = kind(signals_[from].second);
      const bool limits = std::holds_alternative<Saturation>(drawn);
      if (limits && signals_[from].second.magnitude() > kMaxUnlimited_deg) continue;
      if (add_block(from, drawn)) return;
    }
    (void)add_block(from, Play{0});
  }

  bool add_block(std::size_t first, const Kind& drawn) {
    Block block{{}, fmt::format("signal {}", signals_.size()), drawn};
    std::vector<Interval> in;
    for (std::size_t i = 0; i < inputs_of(drawn); ++i) {
      const auto& [name, values] =
          i == 0 ? signals_[first]
                 : signals_[static_cast<std::size_t>(below(static_cast<int>(signals_.size())))];
      block.from.push_back(name);
      in.push_back(values);
    }
    const Interval values =
        std::visit([&](const auto& k) { return k.values(in, model_.sample_period_s); }, drawn);
    if (!(values.magnitude() <= kMaxSignal)) return false;
    signals_.emplace_back(block.to, values);
    model_.blocks.push_back(std::move(block));
    return true;
  }

  // Some signal in degrees, and its limits; sometimes at the bound, sometimes the joint before once more.
  void add_joint(const std::string& name) {
    const double rest_deg = angle();
    if (!model_.joints.empty() && below(4) == 0) {
      model_.joints.push_back({name, model_.joints.back().from, rest_deg});
      return;
    }
    auto at = static_cast<std::size_t>(below(static_cast<int>(signals_.size())));
    const double most = signals_[at].second.magnitude();
    if (most > kMaxUnlimited_deg || coin()) {
      const double reach = coin() ? 0.99 * kMaxUnlimited_deg : 90;
      (void)add_block(at, Lti{sign() * reach / std::max(most, 1e-12), 0, {}, {}});
      at = signals_.size() - 1;
    }
    (void)add_block(at, Saturation{-angle_size(), angle_size()});
    model_.joints.push_back({name, signals_.back().first, rest_deg});
  }

  Kind dead_zone(double largest) {
    const double lower = uniform(-largest, largest);
    return DeadZone{lower, coin() ? lower : lower + uniform(0, largest - lower)};
  }

  Kind hysteresis(double largest) {
    Hysteresis h;
    for (int n = 1 + below(kMaxPlays); n > 0; --n) {
      h.radii.push_back(coin() ? 0 : uniform(0, largest));
      h.weights.push_back(uniform(-7.99, 7.99));
    }
    return h;
  }

  Kind lti(double largest) {
    Lti lti{sign() * uniform(0, 1) * (coin() ? 1 : kMaxSignal / largest / 4), angle(), {}, {}};
    for (int n = below(4); n > 0; --n) lti.poles_rad_s.push_back(-rate(kMinPoleTimesPeriod));
    if (lti.poles_rad_s.size() > 1 && coin()) lti.poles_rad_s[1] = lti.poles_rad_s[0];
    if (coin()) {
      for (const double p : lti.poles_rad_s) lti.taps.push_back(p < -1 ? tap() : (coin() ? 0 : kMaxTap));
    }
    return lti;
  }

  Kind sum() {
    Sum out{{}, angle()};
    for (int n = 1 + below(coin() ? 3 : kMaxTerms); n > 0; --n)
      out.weights.push_back(sign() * wide(1e-6, 10));
    return out;
  }

  // How many is drawn once for x and y.
  std::vector<double> knots(double largest) {
    std::vector<double> x;
    count_ = 2 + below(kMaxKnots - 1);
    for (int i = 0; i < count_; ++i) {
      const double step = coin() ? 2.1e-6 * largest : largest / 20;
      x.push_back(i == 0 ? uniform(-largest, 0) : x.back() + step);
    }
    return x;
  }
  std::vector<double> ordinates() {
    std::vector<double> y;
    for (int i = 0; i < count_; ++i) y.push_back(angle());
    return y;
  }

  double rate(double least) {
    return wide(1.001 * least, 0.999 * kMaxPoleTimesPeriod) / model_.sample_period_s;
  }
  double tap() { return coin() ? 0 : uniform(-kMaxTap, kMaxTap); }
  double angle() { return coin() ? uniform(-kMaxAngle_deg, kMaxAngle_deg) : kMaxAngle_deg; }
  double angle_size() { return coin() ? uniform(1, kMaxAngle_deg) : kMaxAngle_deg; }
  double sign() { return coin() ? 1 : -1; }
  // Even over orders of magnitude, and each bound now and then.
  double wide(double low, double high) {
    const int which = below(8);
    if (which == 0) return low;
    if (which == 1) return high;
    return std::clamp(std::exp(uniform(std::log(low), std::log(high))), low, high);
  }

  std::vector<std::pair<std::string, Interval>> signals_;  // and every value that each can take
  int count_ = 0;
};

}  // namespace flexor::model
