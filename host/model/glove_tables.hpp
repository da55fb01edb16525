// What the signal chain of a glove (runtime/glove/signal_chain.hpp) gets for each finger of a model: integers, all computed
// here in double.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "host/model/model.hpp"
#include "host/model/wiring.hpp"
#include "runtime/sensor/calibration.hpp"
#include "runtime/sensor/guard.hpp"
#include "runtime/sensor/monitor.hpp"
#include "runtime/sensor/zero.hpp"

namespace flexor::model {

// ADC counts -> what the model's input reads, of each sensor.
using Sensors = std::array<std::function<double(double counts)>, kFingers>;

struct GloveTables {
  std::array<sensor::Calibration, kFingers> calibration{};
  std::array<sensor::MonitorSettings, kFingers> monitor{};
  std::array<sensor::GuardSettings, kFingers> guard{};
  std::array<std::uint8_t, kFingers> sensors{};  // a bit for each sensor that the finger's angle needs
  std::array<sensor::Poses, kFingers> poses{};   // of each sensor; equal where the model has none
};

// At the model's own sample rate, 0.1 to 1000 Hz. Throws io::InputError where no counts lie within an input's valid range.
GloveTables glove_tables(const Model& model, const Sensors& sensor);

// The same of any joint of the model.
sensor::GuardSettings guard_of(const Model& model, const Joint& joint);
std::uint8_t sensors_of(const Model& model, const Wiring& wiring, std::size_t joint);

}  // namespace flexor::model
