// Consistent overhead byte stuffing (Cheshire, Baker, IEEE/ACM Trans. Networking 7 (1999) 159): no zero
// inside a frame, one byte more than the payload, and a zero after it. Whatever came before, the next zero
// starts a new frame.
#pragma once

#include <stdint.h>

namespace flexor {
namespace link {

constexpr uint8_t kDelimiter = 0;

// `out` has room for size + 2; returns the bytes written, delimiter included. size is 253 at most.
inline uint8_t cobs_encode(const uint8_t* payload, uint8_t size, uint8_t* out) {
  uint8_t code_at = 0;
  uint8_t at = 1;
  uint8_t code = 1;
  for (uint8_t i = 0; i < size; ++i) {
    if (payload[i] != 0) {
      out[at++] = payload[i];
      ++code;
      continue;
    }
    out[code_at] = code;
    code_at = at++;
    code = 1;
  }
  out[code_at] = code;
  out[at++] = kDelimiter;
  return at;
}

// Decodes in place what stood between two delimiters; returns the payload's size, or 0 for what is no such
// code: empty, with a zero inside, or a run beyond the end.
inline uint8_t cobs_decode(uint8_t* bytes, uint8_t size) {
  uint8_t in = 0;
  uint8_t out = 0;
  while (in < size) {
    const uint8_t code = bytes[in++];
    if (code == 0 || static_cast<uint8_t>(code - 1) > static_cast<uint8_t>(size - in)) return 0;
    for (uint8_t i = 1; i < code; ++i) {
      if (bytes[in] == 0) return 0;
      bytes[out++] = bytes[in++];
    }
    if (in < size) bytes[out++] = 0;
  }
  return out;
}

}  // namespace link
}  // namespace flexor
