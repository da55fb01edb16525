#include "host/model/wiring.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/io/io.hpp"

namespace flexor::model {
namespace {

std::string finger_part(const std::string& joint) { return joint.substr(0, joint.find('_')); }

std::optional<std::size_t> joint_of(const Model& model, const std::string& finger) {
  for (const std::string& wanted : {finger, finger + "_mcp"}) {
    const auto it = std::ranges::find(model.joints, wanted, &Joint::name);
    if (it != model.joints.end()) return static_cast<std::size_t>(it - model.joints.begin());
  }
  const auto it = std::ranges::find_if(model.joints,
                                       [&](const Joint& joint) { return finger_part(joint.name) == finger; });
  if (it == model.joints.end()) return std::nullopt;
  return static_cast<std::size_t>(it - model.joints.begin());
}

std::size_t index_of(const std::string& finger) {
  const auto& names = finger_names();
  return static_cast<std::size_t>(std::ranges::find(names, finger) - names.begin());
}

// Of an input that does not say it: the finger of the only joint that it feeds.
std::size_t strip_of(const Model& model, const Graph& graph, std::size_t input) {
  if (!model.inputs[input].strip.empty()) return index_of(model.inputs[input].strip);
  std::optional<std::size_t> found;
  int feeds = 0;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (std::ranges::find(graph.inputs[graph.joint[j]], input) == graph.inputs[graph.joint[j]].end())
      continue;
    ++feeds;
    const std::size_t finger = index_of(finger_part(model.joints[j].name));
    if (finger < kFingers) found = finger;
  }
  if (found && feeds == 1) return *found;
  throw io::InputError(
      fmt::format("input {}: say in the model which finger's strip it is: \"strip\": \"index\"",
                  model.inputs[input].name));
}

}  // namespace

Wiring wiring_of(const Model& model) {
  const Graph graph(model);
  Wiring out;
  const auto& names = finger_names();
  for (std::size_t i = 0; i < kFingers; ++i) out.joint[i] = joint_of(model, names[i]);
  if (std::ranges::none_of(out.joint, [](const auto& joint) { return joint.has_value(); })) {
    throw io::InputError(fmt::format("none of the model's joints is a finger's ({}): a board moves {}",
                                     model.joints.front().name, fmt::join(names, ", ")));
  }
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    const std::size_t strip = strip_of(model, graph, i);
    if (out.input[strip]) {
      throw io::InputError(fmt::format("inputs {} and {}: both are the {}'s strip; say another \"strip\"",
                                       model.inputs[*out.input[strip]].name, model.inputs[i].name,
                                       names[strip]));
    }
    out.strip.push_back(strip);
    out.input[strip] = i;
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!out.joint[f]) continue;
    for (const std::size_t input : graph.inputs[graph.joint[*out.joint[f]]]) {
      out.strips[f].push_back(out.strip[input]);
    }
  }
  return out;
}

}  // namespace flexor::model
