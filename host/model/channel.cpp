#include "host/model/channel.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexor::model {
namespace {

// A name that the model has not given yet.
std::string fresh(const Model& model, const std::string& wanted) {
  const auto taken = [&](const std::string& name) {
    return std::ranges::find(model.inputs, name, &Input::name) != model.inputs.end() ||
           std::ranges::find(model.blocks, name, &Block::to) != model.blocks.end();
  };
  std::string name = wanted;
  for (int i = 2; taken(name); ++i) name = fmt::format("{} {}", wanted, i);
  return name;
}

std::string input_signal(Model& model, const Channel& c) {
  const std::string first = c.name.substr(0, c.name.find('_'));
  const bool finger = std::ranges::find(finger_names(), first) != finger_names().end();
  Input input{is_name(c.input_column) ? c.input_column : c.name,
              c.input_column,
              c.input_unit,
              finger ? first : "",
              c.valid_min,
              c.valid_max};
  input.name = fresh(model, input.name);
  model.inputs.push_back(input);
  return input.name;
}

const Block* block_of(const Model& model, const std::string& signal) {
  const auto it = std::ranges::find(model.blocks, signal, &Block::to);
  return it == model.blocks.end() ? nullptr : &*it;
}

// Where the signal comes from, if from a block of this kind: takes it and goes on before it.
template <class T>
const T* taken(const Model& model, std::string& signal) {
  const Block* block = block_of(model, signal);
  const T* kind = block != nullptr ? std::get_if<T>(&block->kind) : nullptr;
  if (kind != nullptr) signal = block->from.front();
  return kind;
}

}  // namespace

void add(Model& model, const Channel& c) {
  std::string signal = input_signal(model, c);
  const auto next = [&](const char* what, Kind kind) {
    const std::string to = fresh(model, fmt::format("{} {}", c.name, what));
    model.blocks.push_back({{signal}, to, std::move(kind)});
    signal = to;
  };
  if (c.dead_zone) next("dead zone", *c.dead_zone);
  if (c.hysteresis) next("hysteresis", *c.hysteresis);
  if (c.input_curve) next("curve", *c.input_curve);
  next("dynamics", c.lti);
  if (c.pair) next("pair", *c.pair);
  if (c.output_curve) next("output curve", *c.output_curve);
  next("angle", c.saturation);
  model.joints.push_back({c.name, signal, c.rest_deg});
}

Channel scaled(Channel c, double gain) {
  if (c.dead_zone) c.dead_zone = DeadZone{gain * c.dead_zone->lower, gain * c.dead_zone->upper};
  if (c.hysteresis) std::ranges::for_each(c.hysteresis->radii, [&](double& radius) { radius *= gain; });
  if (c.input_curve) {
    std::ranges::for_each(c.input_curve->x, [&](double& knot) { knot *= gain; });
  } else {
    c.lti.gain /= gain;
  }
  return c;
}

std::optional<Channel> channel(const Model& model, std::size_t at) {
  const Joint& joint = model.joints.at(at);
  Channel c;
  c.name = joint.name;
  c.rest_deg = joint.rest_deg;
  std::string signal = joint.from;
  const auto* saturation = taken<Saturation>(model, signal);
  if (saturation == nullptr) return std::nullopt;
  c.saturation = *saturation;
  if (const auto* curve = taken<Curve>(model, signal)) c.output_curve = *curve;
  if (const auto* pair = taken<PolePair>(model, signal)) c.pair = *pair;
  const auto* lti = taken<Lti>(model, signal);
  if (lti == nullptr) return std::nullopt;
  c.lti = *lti;
  if (const auto* curve = taken<Curve>(model, signal)) c.input_curve = *curve;
  if (const auto* hysteresis = taken<Hysteresis>(model, signal)) c.hysteresis = *hysteresis;
  if (const auto* zone = taken<DeadZone>(model, signal)) c.dead_zone = *zone;
  if (const auto* gain = taken<Gain>(model, signal)) {
    if (gain->offset != 0) return std::nullopt;
    c = scaled(std::move(c), 1 / gain->gain);
  }
  const auto input = std::ranges::find(model.inputs, signal, &Input::name);
  if (input == model.inputs.end()) return std::nullopt;
  c.input_column = input->column;
  c.input_unit = input->unit;
  c.valid_min = input->valid_min;
  c.valid_max = input->valid_max;
  return c;
}

std::vector<Channel> channels(const Model& model) {
  std::vector<Channel> out;
  for (std::size_t i = 0; i < model.joints.size(); ++i) out.push_back(channel(model, i).value());
  return out;
}

Model model_of(const Channel& channel, double period_s) {
  Model model;
  model.sample_period_s = period_s;
  add(model, channel);
  return model;
}

}  // namespace flexor::model
