// Any bytes: no crash, no acceptance without the key, and a good frame is taken right after any delimiter.
#include <stddef.h>
#include <cstdlib>

#include "runtime/link/glove_end.hpp"
#include "runtime/link/hand_end.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace flexor::link;
  static const Key key = {{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}};
  HandEnd hand(&key);
  hand.start(1);
  for (int k = 0; k < kStirred; ++k) hand.stir(1);
  GloveEnd glove(&key);
  Receiver plain(nullptr);
  for (size_t i = 0; i < size; ++i) {
    Received result = hand.push(data[i]);
    while (result == Received::pending) result = hand.verify();
    if (result == Received::frame) std::abort();
    (void)plain.receive(data[i]);
    (void)glove.push(data[i]);
  }
  if (glove.in_touch()) std::abort();
  uint8_t wire[kMaxWire];
  uint8_t bytes = hand.challenge(wire);
  (void)glove.push(kDelimiter);
  for (uint8_t i = 0; i < bytes; ++i) (void)glove.push(wire[i]);
  if (!glove.in_touch()) std::abort();
  Frame frame = {};
  bytes = glove.angles(frame, false, wire);
  (void)hand.push(kDelimiter);
  Received last = Received::nothing;
  for (uint8_t i = 0; i < bytes; ++i) last = hand.push(wire[i]);
  while (last == Received::pending) last = hand.verify();
  if (last != Received::frame) std::abort();
  return 0;
}
