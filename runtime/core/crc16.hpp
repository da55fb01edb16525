// CRC-16/XMODEM: polynomial 0x1021, start 0 where no other is named, no reflection, no final exclusive-or; check("123456789") =
// 0x31C3. Detects every burst of up to 16 bits and every odd number of flipped bits in a frame.
#pragma once

#include <stdint.h>

namespace flexor {
namespace core {

inline uint16_t crc16_add(uint16_t crc, uint8_t byte) {
  // Four bits at a time without a table: a few dozen cycles a byte on an AVR, no flash for a table.
  uint8_t x = static_cast<uint8_t>((crc >> 8) ^ byte);
  x = static_cast<uint8_t>(x ^ (x >> 4));
  return static_cast<uint16_t>((crc << 8) ^ (static_cast<uint16_t>(x) << 12) ^
                               (static_cast<uint16_t>(x) << 5) ^ x);
}

inline uint16_t crc16(const uint8_t* bytes, uint8_t size, uint16_t crc = 0) {
  for (uint8_t i = 0; i < size; ++i) crc = crc16_add(crc, bytes[i]);
  return crc;
}

}  // namespace core
}  // namespace flexor
