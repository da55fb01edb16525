// Models for tests: any that the document allows, drawn from a seed; numbers often lie on their very bounds.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

class RandomModel {
 public:
  explicit RandomModel(unsigned seed) : random_(seed) {}

  Model make() {
    Model m;
    m.name = "random \"model\"\n\xc3\xa9";
    m.written_by = "test";
    m.sample_period_s = wide(kMinPeriod_s, kMaxPeriod_s);
    std::vector<std::string> names = finger_names();
    std::ranges::shuffle(names, random_);
    names.resize(1 + static_cast<std::size_t>(below(5)));
    for (const std::string& name : names) m.channels.push_back(channel(name, m.sample_period_s));
    m.training = {{"split", uniform(0, 1)}, {"files", {"a.csv", "b.csv"}}};
    return m;
  }

 private:
  Channel channel(const std::string& name, double period_s) {
    Channel c;
    c.name = name;
    c.input_column = coin() ? "Sensor \\ 1" : "";
    c.input_unit = coin() ? "count" : "";
    // Of readings in farad, volt, count or ohm.
    const double largest = wide(1e-12, kMaxReading);
    c.valid_min = coin() ? 0 : uniform(-largest, largest / 2);
    c.valid_max = coin() ? largest : std::max(uniform(largest / 2, largest), c.valid_min + 1e-3 * largest);
    c.rest_deg = angle();
    if (coin()) {
      c.dead_zone = DeadZone{uniform(-largest, largest), 0};
      c.dead_zone->upper = c.dead_zone->lower + uniform(0, largest - c.dead_zone->lower);
    }
    if (coin()) {
      Hysteresis h;
      for (int j = 0; j <= below(kMaxPlays); ++j) {
        h.radii.push_back(coin() ? 0 : uniform(0, largest));
        h.weights.push_back(uniform(-7.99, 7.99));
      }
      c.hysteresis = h;
    }
    c.lti.poles_rad_s = poles(period_s);
    if (coin()) {
      for (const double p : c.lti.poles_rad_s) {
        c.lti.taps.push_back(p < -1 ? uniform(-kMaxTap, kMaxTap) : (coin() ? 0 : kMaxTap));
      }
    }
    const bool curve_before = coin();
    if (coin()) c.output_curve = curve(uniform(0.5, 1) * kMaxReading, [&] { return angle(); });
    if (curve_before) {
      c.input_curve = curve(largest, [&] { return angle() / 2; });
      c.lti.gain = uniform(-1, 1);
      c.lti.offset = angle() / 2;
    } else {
      // After the dead zone and four plays of the largest weight and radius, a reading is at most forty
      // times.
      const double reach = c.output_curve ? kMaxReading : kMaxLinear_deg;
      c.lti.gain = uniform(-1, 1) * reach / largest / 80;
      c.lti.offset = uniform(-1, 1) * reach / 4;
    }
    c.saturation = {-angle_size(), angle_size()};
    return c;
  }

  std::vector<double> poles(double period_s) {
    std::vector<double> out(static_cast<std::size_t>(below(4)));
    for (double& p : out) p = -wide(1.001 * kMinPoleTimesPeriod, 0.999 * kMaxPoleTimesPeriod) / period_s;
    if (out.size() > 1 && coin()) out[1] = out[0];
    return out;
  }

  template <class Value>
  Curve curve(double largest_x, const Value& value) {
    Curve c;
    for (int i = 0; i < 2 + below(kMaxKnots - 1); ++i) {
      const double step = coin() ? 1.01 * kMinKnotSpacing * largest_x : largest_x / 20;
      c.x.push_back(i == 0 ? uniform(-largest_x, 0) : c.x.back() + step);
      c.y.push_back(value());
    }
    return c;
  }

  double angle() { return coin() ? uniform(-kMaxAngle_deg, kMaxAngle_deg) : kMaxAngle_deg; }
  double angle_size() { return coin() ? uniform(1, kMaxAngle_deg) : kMaxAngle_deg; }
  bool coin() { return below(2) == 0; }
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  // Even over orders of magnitude, and each bound now and then.
  double wide(double low, double high) {
    const int which = below(8);
    if (which == 0) return low;
    if (which == 1) return high;
    return std::clamp(std::exp(uniform(std::log(low), std::log(high))), low, high);
  }

  std::mt19937 random_;
};

}  // namespace flexor::model
