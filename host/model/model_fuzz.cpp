// Any bytes as a model: either an InputError, or a document that round-trips and, in every arithmetic that
// can hold it, answers every reading with a finite angle within its limits.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vector>

#include "host/io/fuzz_json.hpp"
#include "host/model/compensator.hpp"

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Arithmetic>
void run(const flexor::model::Model& model) {
  flexor::model::Compensator<Arithmetic> simulation(model);
  std::vector<double> u;
  for (const auto& input : model.inputs) u.push_back(input.valid_min);
  const auto step = [&] {
    const auto samples = simulation.step(u);
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const auto& limits = flexor::model::limits(model, model.joints[j]);
      const double y = samples[j].angle_deg;  // finite and safe whatever the status says
      if (!(y >= limits.lower_deg - 0.1 && y <= limits.upper_deg + 0.1)) std::abort();
    }
  };
  // A document may have hundreds of inputs: a few are enough.
  for (std::size_t i = 0; i < std::min<std::size_t>(model.inputs.size(), 8); ++i) {
    const double low = model.inputs[i].valid_min;
    const double high = model.inputs[i].valid_max;
    const auto give = [&](double reading) {
      u[i] = reading;
      step();
    };
    for (int round = 0; round < 2; ++round) {
      for (const double reading : {low, kNan, high, kInfinity, low, -kInfinity, 1e308, -1e308, high, 0.0,
                                   -0.0, 1e-308, 1023.0, 512.0, -1e9, 1e9}) {
        give(reading);
      }
      constexpr int kRamp = 16;
      for (int k = 0; k <= kRamp; ++k) give(low + (high - low) * k / kRamp);
      for (int k = kRamp; k >= 0; --k) give(k % 3 == 0 ? low : low + (high - low) * k / kRamp);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexor;
  try {
    const model::Model m = model::from_json({reinterpret_cast<const char*>(data), size}, "fuzz");
    if (model::from_json(model::to_json(m), "again") != m) std::abort();
    run<model::DoubleArithmetic>(m);
    run<model::FloatArithmetic>(m);
    run<model::FixedArithmetic>(m);
  } catch (const io::InputError&) {
  }
  return 0;
}
