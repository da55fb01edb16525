// For tests: gloves in counts, whose models need no file.
#pragma once

#include <fmt/format.h>

#include <cmath>

#include "host/deploy/hardware.hpp"

namespace flexor::deploy {

// A glove of five chains in counts.
inline Glove plain_glove(double rate_hz) {
  model::Model model;
  model.name = "plain";
  model.sample_period_s = 1 / rate_hz;
  for (const std::string& finger : model::finger_names()) {
    model.inputs.push_back({finger, finger, "count", finger, 300, 900});
    model.blocks.push_back({{finger}, finger + " curve", model::Curve{{400, 600, 800}, {0, 50, 90}}});
    model.blocks.push_back({{finger + " curve"}, finger + " lag", model::Lag{5}});
    model.blocks.push_back({{finger + " lag"}, finger + " angle", model::Saturation{10, 80}});
    model.joints.push_back({finger, finger + " angle", 30, {}});
  }
  Glove glove;
  glove.model = model;
  glove.sensor.fill(counts_as_they_are());
  return glove;
}

// Five fingers, each a sum of curves on the same knots of its sensor, and of a lag behind the first.
inline Glove glove_of_shared_knots(int knots, int curves, double height_deg = 90) {
  Glove glove = plain_glove(50);
  glove.model.blocks.clear();
  for (const std::string& finger : model::finger_names()) {
    model::Sum sum;
    std::vector<std::string> from;
    for (int c = 0; c < curves; ++c) {
      model::Curve curve;
      for (int i = 0; i < knots; ++i) {
        curve.x.push_back(400 + i * 400.0 / (knots - 1));
        curve.y.push_back(i * height_deg / (knots - 1) / curves + std::sin(i + c));
      }
      from.push_back(fmt::format("{} curve {}", finger, c));
      glove.model.blocks.push_back({{finger}, from.back(), curve});
    }
    glove.model.blocks.push_back({{from[0]}, finger + " lag", model::Lag{5}});
    from[0] = finger + " lag";
    sum.weights.assign(from.size(), 1);
    glove.model.blocks.push_back({from, finger + " sum", sum});
    glove.model.blocks.push_back({{finger + " sum"}, finger + " angle", model::Saturation{10, 80}});
  }
  return glove;
}

}  // namespace flexor::deploy
