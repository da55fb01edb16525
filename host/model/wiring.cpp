#include "host/model/wiring.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/io/io.hpp"

namespace flexor::model {
namespace {

std::string finger_part(const std::string& joint) { return joint.substr(0, joint.find('_')); }

std::optional<std::size_t> joint_of(const Model& model, const std::string& finger) {
  const auto rank = [&](const Joint& joint) {
    if (joint.name == finger) return 0;
    return joint.name == finger + "_mcp" ? 1 : finger_part(joint.name) == finger ? 2 : 3;
  };
  const auto best = std::ranges::min_element(model.joints, {}, rank);
  if (rank(*best) == 3) return std::nullopt;
  return static_cast<std::size_t>(best - model.joints.begin());
}

std::size_t index_of(const std::string& finger) {
  const auto& names = finger_names();
  return static_cast<std::size_t>(std::ranges::find(names, finger) - names.begin());
}

// Of an input that names none: the finger that it is named after, or that of the only joint that it feeds.
std::optional<std::size_t> sensor_of(const Model& model, const Graph& graph, std::size_t input) {
  const std::size_t named = index_of(finger_part(model.inputs[input].name));
  if (named < kFingers) return named;
  std::optional<std::size_t> found;
  int feeds = 0;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (std::ranges::find(graph.inputs[graph.joint[j]], input) == graph.inputs[graph.joint[j]].end())
      continue;
    ++feeds;
    const std::size_t finger = index_of(finger_part(model.joints[j].name));
    if (finger < kFingers) found = finger;
  }
  return feeds == 1 ? found : std::nullopt;
}

// Those that name their sensor first, then those that have one by name or joint, then the others on what is free.
void add_sensors(const Model& model, const Graph& graph, Wiring& out) {
  const auto& names = finger_names();
  std::vector<std::optional<std::size_t>> finger_of(model.inputs.size());
  const auto take = [&](std::size_t input, std::size_t finger) {
    finger_of[input] = finger;
    out.input[finger] = input;
  };
  for (std::size_t i = 0; i < finger_of.size(); ++i) {
    if (model.inputs[i].strip.empty()) continue;
    const std::size_t finger = index_of(model.inputs[i].strip);
    if (out.input[finger]) {
      throw io::InputError("inputs {} and {}: both name the {}'s sensor",
                           model.inputs[*out.input[finger]].name, model.inputs[i].name, names[finger]);
    }
    take(i, finger);
  }
  for (std::size_t i = 0; i < finger_of.size(); ++i) {
    const auto finger = finger_of[i] ? std::nullopt : sensor_of(model, graph, i);
    if (finger && !out.input[*finger]) take(i, *finger);
  }
  for (std::size_t i = 0; i < finger_of.size(); ++i) {
    if (finger_of[i]) continue;
    const auto free = std::ranges::find(out.input, std::optional<std::size_t>());
    if (free == out.input.end())
      throw io::InputError("input {}: a glove has five sensors", model.inputs[i].name);
    take(i, static_cast<std::size_t>(free - out.input.begin()));
    out.guessed.push_back(i);
  }
  for (const auto& finger : finger_of) out.sensor.push_back(*finger);
}

}  // namespace

std::size_t finger_index(std::string_view name) {
  return static_cast<std::size_t>(std::ranges::find(finger_names(), finger(name)) - finger_names().begin());
}

Wiring wiring_of(const Model& model) {
  const Graph graph(model);
  Wiring out;
  const auto& names = finger_names();
  for (std::size_t i = 0; i < kFingers; ++i) out.joint[i] = joint_of(model, names[i]);
  if (std::ranges::none_of(out.joint, [](const auto& joint) { return joint.has_value(); })) {
    throw io::InputError(
        "none of the model's joints is a finger's ({}): a board moves {}; identify it as one of them: "
        "--map index=SENSOR:ANGLE, with --poses --joints index,...",
        model.joints.front().name, fmt::join(names, ", "));
  }
  add_sensors(model, graph, out);
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!out.joint[f]) continue;
    for (const std::size_t input : graph.inputs[graph.joint[*out.joint[f]]]) {
      out.sensors[f].push_back(out.sensor[input]);
    }
  }
  return out;
}

std::vector<std::string> missing_fingers(const Model& model) {
  const Wiring wiring = wiring_of(model);
  std::vector<std::string> out;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (!wiring.joint[f]) out.push_back(finger_names()[f]);
  }
  return out;
}

std::vector<std::string> left_out(const Model& model) {
  const Wiring wiring = wiring_of(model);
  std::vector<std::string> out;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (std::ranges::find(wiring.joint, std::optional(j)) == wiring.joint.end())
      out.push_back(model.joints[j].name);
  }
  return out;
}

}  // namespace flexor::model
