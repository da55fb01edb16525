// Any text: no crash, and what parses survives the way back out and in again.
#include <stddef.h>
#include <stdlib.h>

#include "runtime/link/opengloves.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace flexor::link;
  if (size > 1000) return 0;
  GloveLine line;
  if (parse_gloves(reinterpret_cast<const char*>(data), static_cast<uint16_t>(size), line) != GloveParse::ok)
    return 0;
  char text[kMaxGloveText];
  const uint8_t bytes = encode_gloves(line.flexion, text);
  GloveLine again;
  if (bytes > kMaxGloveText || parse_gloves(text, bytes, again) != GloveParse::ok) abort();
  for (uint8_t i = 0; i < kGloveFingers; ++i) {
    const uint16_t limited = line.flexion[i] > kGloveTop ? kGloveTop : line.flexion[i];
    if (again.flexion[i] != limited) abort();
  }
  return 0;
}
