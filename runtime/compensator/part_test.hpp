// For tests: a model as bytes.
#pragma once

#include <vector>

#include "runtime/compensator/graph.hpp"

namespace flexor {
namespace compensator {

inline void put16(std::vector<uint8_t>& to, int value) {
  to.push_back(static_cast<uint8_t>(value));
  to.push_back(static_cast<uint8_t>(value >> 8));
}

// Of one sensor and the finger of its number, at 50 Hz: a section of these operations, with so many signals in all.
inline std::vector<uint8_t> part_of(uint8_t finger, uint8_t signals, const std::vector<uint8_t>& code) {
  const uint8_t bit = static_cast<uint8_t>(1 << finger);
  std::vector<uint8_t> part = {kGraphVersion, 0, 0, 50, 1, 1, 0, 1, signals, finger};
  for (const int value : {0, 0, 1023, -30000, 30000, 0, 0}) put16(part, value);
  part.insert(part.end(), {finger, static_cast<uint8_t>(finger << 5 | bit)});
  for (const int value : {0, 0, 1440}) put16(part, value);
  part.push_back(bit);
  put16(part, static_cast<int>(code.size()));
  part.insert(part.end(), code.begin(), code.end());
  const std::size_t size = part.size() + kCrcBytes;
  part[1] = static_cast<uint8_t>(size);
  part[2] = static_cast<uint8_t>(size >> 8);
  uint16_t crc = 0;
  for (const uint8_t byte : part) crc = core::crc16_add(crc, byte);
  put16(part, crc);
  return part;
}

}  // namespace compensator
}  // namespace flexor
