#include "host/model/glove_tables.hpp"

#include <algorithm>
#include <cmath>

#include "host/io/io.hpp"

namespace flexor::model {
namespace {

constexpr double kRail_s = 0.1;  // on a rail for so long: dead. A scratch is forgiven
constexpr double kStuck_s = 2;   // the very same reading for so long: dead
constexpr double kHold_s = 0.25;
constexpr double kGuardSpeed_deg_s = 200;

std::int16_t q4(double deg) { return static_cast<std::int16_t>(std::lround(deg * 16)); }
std::int16_t q5(double reading) {
  return static_cast<std::int16_t>(std::lround(32 * std::clamp(reading, -1023.0, 1023.0)));
}

// The monitor counts to 255, which rates above 127 Hz reach in less than kStuck_s.
std::uint8_t samples(double lasts_s, const Model& model, double least) {
  return static_cast<std::uint8_t>(std::clamp(std::round(lasts_s / model.sample_period_s), least, 255.0));
}

sensor::GuardSettings guard_at_rest(const Model& model, double rest_deg) {
  constexpr double kRounding = 1e-6;  // of a period's inverse
  return {q4(rest_deg), q4(kGuardSpeed_deg_s * model.sample_period_s),
          static_cast<std::uint16_t>(std::ceil(kHold_s / model.sample_period_s - kRounding))};
}

// Of a sensor that feeds an input. A broken one reads near an end of the ADC: its rails lie half way from what the model takes,
// beyond which another hand or a sensor that has drifted reads, too.
void add_sensor(const std::function<double(double)>& sensor, const Input& input,
                sensor::Calibration& calibration, sensor::MonitorSettings& monitor) {
  for (std::size_t k = 0; k < sensor::kKnots; ++k)
    calibration.alpha[k] = q5(sensor(16.0 * static_cast<double>(k)));
  const auto accepted = [&](int n) {
    const double u = calibration(static_cast<std::uint16_t>(n)) / 32.0;
    return u >= input.valid_min && u <= input.valid_max;
  };
  int low = 0;
  while (low < sensor::kAdcTop && !accepted(low)) ++low;
  int high = sensor::kAdcTop;
  while (high > 0 && !accepted(high)) --high;
  if (low >= high) {
    throw io::InputError("input {}: no ADC reading lies within its valid range {:g} to {:g} {}", input.name,
                         input.valid_min, input.valid_max, input.unit);
  }
  monitor.low = static_cast<std::uint16_t>(std::max(low - 1, 0) / 2);
  monitor.high = static_cast<std::uint16_t>((std::min(high + 2, sensor::kAdcTop + 1) + sensor::kAdcTop) / 2);
}

}  // namespace

sensor::GuardSettings guard_of(const Model& model, const Joint& joint) {
  const Saturation& range = limits(model, joint);
  return guard_at_rest(model, std::clamp(joint.rest_deg, range.lower_deg, range.upper_deg));
}

std::uint8_t sensors_of(const Model& model, const Wiring& wiring, std::size_t joint) {
  const Graph graph(model);
  unsigned out = 0;
  for (const std::size_t input : graph.inputs[graph.joint[joint]]) out |= 1U << wiring.sensor[input];
  return static_cast<std::uint8_t>(out);
}

GloveTables glove_tables(const Model& model, const Sensors& sensor) {
  const Wiring wiring = wiring_of(model);
  GloveTables out;
  for (std::size_t i = 0; i < kFingers; ++i) {
    sensor::MonitorSettings& monitor = out.monitor[i];
    monitor.rail_samples = samples(kRail_s, model, 1);
    monitor.stuck_samples = samples(kStuck_s, model, 2);
    out.guard[i] = guard_at_rest(model, 0);
    if (wiring.input[i]) {
      const Input& input = model.inputs[*wiring.input[i]];
      add_sensor(sensor[i], input, out.calibration[i], monitor);
      if (input.poses) out.poses[i] = {q5(input.poses->open), q5(input.poses->fist)};
    } else {
      monitor.high = 0;  // no sensor: open, always
    }
    for (const std::size_t channel : wiring.sensors[i])
      out.sensors[i] = static_cast<std::uint8_t>(out.sensors[i] | 1U << channel);
    if (wiring.joint[i]) out.guard[i] = guard_of(model, model.joints[*wiring.joint[i]]);
  }
  return out;
}

}  // namespace flexor::model
