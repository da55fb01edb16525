// What a hand's firmware will instantiate: five position loops.
#include "runtime/hand/position_loop.hpp"

flexor::hand::LoopSettings settings;
flexor::hand::LoopState states[5];
volatile int16_t command[5];
volatile int16_t potentiometer[5];
volatile int16_t duty[5];

int main() {
  for (int i = 0; i < 5; ++i) flexor::hand::start(settings, states[i], potentiometer[i]);
  for (;;) {
    for (int i = 0; i < 5; ++i)
      duty[i] = flexor::hand::step(settings, states[i], command[i], potentiometer[i]);
  }
}
