// What a glove's firmware will instantiate: five channels, with every block switched on.
#include "runtime/compensator/compensator.hpp"

using AllBlocks = flexor::compensator::Shape<4, 10, 3, 8>;
#ifdef FIXED_POINT
using Arithmetic = flexor::compensator::Fixed<AllBlocks>;
#else
using Arithmetic = flexor::compensator::Floating<float, AllBlocks>;
#endif
using Glove = flexor::compensator::Compensator<Arithmetic, AllBlocks, 5>;

Glove::Coefficients coefficients[5];
volatile Glove::Input adc[5];
volatile Glove::Output angle_deg[5];
volatile flexor::core::Status status[5];

int main() {
  Glove glove(coefficients);
  for (;;) {
    Glove::Input in[5];
    Glove::Output out[5];
    flexor::core::Status statuses[5];
    for (int i = 0; i < 5; ++i) in[i] = adc[i];
    glove.step(in, out, statuses);
    for (int i = 0; i < 5; ++i) {
      angle_deg[i] = out[i];
      status[i] = statuses[i];
    }
  }
}
