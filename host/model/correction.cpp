#include "host/model/correction.hpp"

#include <algorithm>

#include "host/io/io.hpp"

namespace flexor::model {
namespace {

constexpr double kFixedReach = 1023;  // readings that a board's Q5 holds

std::string calibrated(const Input& input) { return io::start_of("calibrated " + input.name, 100); }

// The block that corrects this input, if there is one.
std::vector<Block>::iterator correcting(Model& model, const Input& input) {
  return std::ranges::find_if(model.blocks, [&](const Block& block) {
    return block.to == calibrated(input) && block.from == std::vector{input.name} &&
           std::holds_alternative<Gain>(block.kind);
  });
}

void rename_takers(Model& model, const std::string& from, const std::string& to) {
  for (Block& block : model.blocks) std::ranges::replace(block.from, from, to);
}

template <class Map>
void map_poses_and_readings(Input& input, const Map& map) {
  if (input.poses) input.poses = {map(input.poses->open), map(input.poses->fist)};
  if (input.turns) input.turns = {map(input.turns->open), map(input.turns->fist)};
  if (!input.readings) return;
  for (double& reading : input.readings->reading) reading = map(reading);
}

bool between_rails(const Input& input, const Poses& poses) {
  return std::min(poses.open, poses.fist) >= input.valid_min &&
         std::max(poses.open, poses.fist) <= input.valid_max;
}

}  // namespace

Correction correction_of(const Model& model, std::size_t input) {
  Model copy = model;
  const auto block = correcting(copy, copy.inputs.at(input));
  if (block == copy.blocks.end()) return {};
  const Gain& gain = std::get<Gain>(block->kind);
  return {gain.gain, gain.offset};
}

Model corrected(Model model, std::size_t at, const Correction& correction) {
  Input& input = model.inputs.at(at);
  if (!(correction.gain > 0)) throw io::InputError("{}: a gain must be above zero", input.name);
  const Correction all = correction_of(model, at).after(correction);
  const auto block = correcting(model, input);
  if (block == model.blocks.end()) {
    rename_takers(model, input.name, calibrated(input));
    model.blocks.insert(model.blocks.begin(), {{input.name}, calibrated(input), Gain{all.gain, all.shift}});
  } else {
    block->kind = Gain{all.gain, all.shift};
  }
  const auto now = [&](double made) { return correction.inverse(made); };
  map_poses_and_readings(input, now);
  if (input.donnings) input.donnings->shift_sd /= correction.gain;
  if (input.unit != "count") {
    input.valid_min = now(input.valid_min);
    input.valid_max = now(input.valid_max);
  }
  // A pose beyond the converter's rails is none that a board could be zeroed by.
  for (std::optional<Poses>* pose : {&input.poses, &input.turns})
    if (*pose && input.unit == "count" && !between_rails(input, **pose)) pose->reset();
  check(model);
  return model;
}

Folded folded(Model model) {
  Folded out;
  for (std::size_t i = 0; i < model.inputs.size(); ++i) {
    out.correction.push_back(correction_of(model, i));
    Input& input = model.inputs[i];
    const auto block = correcting(model, input);
    if (block == model.blocks.end()) continue;
    model.blocks.erase(block);
    rename_takers(model, calibrated(input), input.name);
    const Correction& made = out.correction.back();
    map_poses_and_readings(input, made);
    if (input.donnings) input.donnings->shift_sd *= made.gain;
    const auto within = [](double reading) { return std::clamp(reading, -kFixedReach, kFixedReach); };
    const bool counts = input.unit == "count";
    input.valid_min = counts ? within(made(input.valid_min)) : made(input.valid_min);
    input.valid_max = counts ? within(made(input.valid_max)) : made(input.valid_max);
  }
  out.model = std::move(model);
  return out;
}

}  // namespace flexor::model
