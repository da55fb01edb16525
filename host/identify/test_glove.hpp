// A glove of three fingers that bend between 0 and 90 degrees, and what its sensors read; for this room's tests.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "host/identify/recalibrate.hpp"

namespace flexor::identify {

constexpr double kTestPeriod_s = 0.05;
constexpr double kTestStraight = 300;  // counts
constexpr double kTestFist = 600;

// Curves that bend, as strips' do.
inline model::Model test_glove() {
  model::Model m;
  m.sample_period_s = kTestPeriod_s;
  for (const std::string name : {"thumb", "index", "middle"}) {
    m.inputs.push_back({name, name, "count", name, 1, 1022});
    m.inputs.back().poses = model::Poses{kTestStraight, kTestFist};
    m.inputs.back().readings = model::Spread{{0.02, 0.1, 0.5, 0.9, 0.98}, {302, 310, 450, 590, 598}};
    m.blocks.push_back(
        {{name}, name + "_curve", model::Curve{{200, 300, 450, 600, 700}, {-20, 0, 55, 90, 105}}});
    m.blocks.push_back({{name + "_curve"}, name + "_angle", model::Saturation{-30, 110}});
    m.joints.push_back({name, name + "_angle", 0});
  }
  return m;
}

// Readings of one sensor as it was made: cycles of four seconds, each end reached to within `scatter` of the span.
inline std::vector<double> test_cycles(double cycles, double scatter, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double span = kTestFist - kTestStraight;
  std::vector<double> out;
  double low = kTestStraight + scatter * span * normal(random);
  double high = kTestFist + scatter * span * normal(random);
  const int half = static_cast<int>(2 / kTestPeriod_s);
  for (int k = 0; k < static_cast<int>(2 * cycles * half); ++k) {
    if (k > 0 && k % half == 0) {
      double& end = (k / half) % 2 == 0 ? high : low;
      end = (&end == &low ? kTestStraight : kTestFist) + scatter * span * normal(random);
    }
    const double phase = static_cast<double>(k) / half * std::numbers::pi;
    out.push_back(low + (high - low) * (0.5 - 0.5 * std::cos(phase)) + normal(random));
  }
  return out;
}

}  // namespace flexor::identify
