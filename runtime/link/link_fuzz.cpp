// Any bytes: no crash, no acceptance without the key, and a good frame is taken right after any delimiter.
#include <stddef.h>
#include <cstdlib>

#include "runtime/link/receiver.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace flexor::link;
  static const Key key = {{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}};
  Receiver sealed(&key);
  Receiver plain(nullptr);
  for (size_t i = 0; i < size; ++i) {
    if (sealed.receive(data[i]) == Received::frame) std::abort();
    (void)plain.receive(data[i]);
  }
  Frame frame = {};
  frame.counter = 7;
  uint8_t wire[kWireSealed];
  const uint8_t bytes = encode(frame, &key, wire);
  (void)sealed.receive(kDelimiter);
  Received last = Received::nothing;
  for (uint8_t i = 0; i < bytes; ++i) last = sealed.receive(wire[i]);
  if (last != Received::frame) std::abort();
  return 0;
}
