// What both firmwares will instantiate.
#include "runtime/link/glove_end.hpp"
#include "runtime/link/hand_end.hpp"

flexor::link::Key key;
flexor::link::Frame out;
uint8_t wire[flexor::link::kMaxWire];
volatile uint8_t uart;
volatile int16_t angle;

int main() {
  flexor::link::GloveEnd glove(&key);
  flexor::link::HandEnd hand(&key);
  hand.start(1);
  for (;;) {
    hand.tick();
    if (hand.due() == flexor::link::HandEnd::Speech::challenge) hand.challenge(wire);
    glove.push(uart);
    if (glove.in_touch()) glove.angles(out, true, wire);
    if (hand.push(uart) != flexor::link::Received::pending) continue;
    if (hand.verify() == flexor::link::Received::frame) angle = hand.receiver().frame().angle[0];
  }
}
