// What both firmwares will instantiate.
#include "runtime/link/receiver.hpp"

flexor::link::Key key;
flexor::link::Frame out;
uint8_t wire[flexor::link::kWireSealed];
volatile uint8_t uart;
volatile int16_t angle;

int main() {
  flexor::link::Receiver receiver(&key);
  for (;;) {
    const uint8_t size = flexor::link::encode(out, &key, wire);
    for (uint8_t i = 0; i < size; ++i) uart = wire[i];
    if (receiver.receive(uart) == flexor::link::Received::frame) angle = receiver.frame().angle[0];
  }
}
