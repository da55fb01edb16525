// A joint from one sensor through a chain of blocks in a fixed order: what the published compensators
// and the fits of one finger are.
#pragma once

#include <optional>
#include <string>

#include "host/model/model.hpp"

namespace flexor::model {

struct Channel {
  std::string name;          // of the joint
  std::string input_column;  // may be empty
  std::string input_unit;
  double valid_min = 0;
  double valid_max = 1023;
  double rest_deg = 0;
  std::optional<DeadZone> dead_zone;
  std::optional<Hysteresis> hysteresis;
  std::optional<Curve> input_curve;
  Lti lti;
  std::optional<PolePair> pair;
  std::optional<Curve> output_curve;
  Saturation saturation;
  bool operator==(const Channel&) const = default;
};

// The chain that makes of readings `gain` times as large what `channel` makes of the readings; gain > 0.
Channel scaled(Channel channel, double gain);

// Adds an input, blocks and a joint.
void add(Model& model, const Channel& channel);

// The joint `at` as a chain; none where its graph is none of this order.
std::optional<Channel> channel(const Model& model, std::size_t at);

// Every joint as a chain, which each must be.
std::vector<Channel> channels(const Model& model);

// One chain as a model of its own.
Model model_of(const Channel& channel, double period_s);

}  // namespace flexor::model
