// Any bytes as a model: either a document that round-trips and runs, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "host/io/io.hpp"
#include "host/model/simulation.hpp"

namespace {

template <class Arithmetic>
void run(const flexor::model::Model& model) {
  flexor::model::Simulation<Arithmetic> simulation(model);
  for (const double u : {0.0, 1023.0, 512.0, -1e9, 1e9}) {
    for (std::size_t i = 0; i < simulation.channels(); ++i) {
      const double y = simulation.step(i, u).angle_deg;
      const auto& limits = model.channels[i].saturation;
      if (!(y >= limits.lower_deg - 0.1 && y <= limits.upper_deg + 0.1)) std::abort();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexor;
  try {
    const model::Model m = model::from_json({reinterpret_cast<const char*>(data), size}, "fuzz");
    if (model::from_json(model::to_json(m), "again") != m) std::abort();
    run<model::FixedArithmetic>(m);
  } catch (const io::InputError&) {
  }
  return 0;
}
