// For tests: a glove of one sensor, 300 at the open hand and 700 at the fist or where the poses are.
#pragma once

#include <optional>

#include "host/model/channel.hpp"

namespace flexor::model {

inline Model sensor_model(std::optional<Poses> poses) {
  Model m;
  m.sample_period_s = 1 / 50.;
  Channel c;
  c.name = "index";
  c.input_column = "index_count";
  c.valid_min = 150;
  c.valid_max = 850;
  c.saturation = {28, 113};
  add(m, c);
  m.inputs[0].poses = poses;
  return m;
}

}  // namespace flexor::model
