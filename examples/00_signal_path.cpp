// The signal path on one page: a model document, the runtime compensator that it describes, and one finger's
// closing as the glove would compute it, in double and in the fixed point that ships.
//
//   signal_path models/published_hw.json
#include <cstdio>

#include "host/model/simulation.hpp"

int main(int argc, char** argv) {
  using namespace flexor;
  const model::Model m = model::load(argc > 1 ? argv[1] : "models/published_hw.json");
  model::Simulation<model::DoubleArithmetic> exact(m);
  model::Simulation<model::FixedArithmetic> fixed(m);
  constexpr std::size_t kIndex = 1;
  std::printf("%s, %s finger, every %.0f ms\n", m.name.c_str(), m.channels[kIndex].name.c_str(),
              1000 * m.sample_period_s);
  std::printf("   t (s)   reading   angle (deg)   fixed point\n");
  for (int k = 0; k < 12; ++k) {
    const double alpha = k < 3 ? 45 : 100;  // the finger straightens at once
    const double y = exact.step(kIndex, alpha).angle_deg;
    std::printf("%8.1f %9.0f %13.3f %13.4f\n", k * m.sample_period_s, alpha, y,
                fixed.step(kIndex, alpha).angle_deg);
  }
}
