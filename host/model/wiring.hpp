// A model's joints and inputs on a glove and a hand: five sensors, five motors, thumb to pinky.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "host/model/model.hpp"

namespace flexor::model {

inline constexpr std::size_t kFingers = 5;  // of finger_names()

// 0 for thumb to 4 for pinky; aliases as in finger(). Throws io::InputError, listing the names.
std::size_t finger_index(std::string_view name);

// Which joint of the model moves each finger, and which finger's sensor feeds each of its inputs.
struct Wiring {
  std::array<std::optional<std::size_t>, kFingers> joint;  // of model.joints
  std::vector<std::size_t> sensor;                         // finger of model.inputs[i]
  std::array<std::optional<std::size_t>, kFingers> input;  // of model.inputs, for each sensor
  std::vector<std::size_t> guessed;                        // inputs that no name, sensor or joint places
  std::array<std::vector<std::size_t>, kFingers> sensors;  // that each finger's joint depends on
};

// A finger's joint is the one of its name, else its _mcp, else its first. An input names its sensor, or it is named
// after it (index_adc), or it is that of the only joint that it feeds; what is left goes on the free ones, thumb first.
// Throws io::InputError.
Wiring wiring_of(const Model& model);

// Names of the fingers that no joint of the model moves.
std::vector<std::string> missing_fingers(const Model& model);

// Names of joints that move no finger: another joint of its finger does, or it is none's.
std::vector<std::string> left_out(const Model& model);

}  // namespace flexor::model
