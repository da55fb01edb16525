// A block of data in flash, in two copies, of which the newest whole one counts. Only a bootloader writes them, one while
// the other stays: power that is lost at any instant leaves the old block or the new one.
//
//   copy   generation u16, size u16, CRC-16 of these and of the bytes, 0 u16; the bytes
#pragma once

#include "runtime/core/crc16.hpp"
#include "runtime/core/memory.hpp"

namespace flexor {
namespace core {

constexpr uint8_t kFlashPage = 128;  // bytes, of an ATmega328P
constexpr uint8_t kCopyHead = 8;

struct Copy {
  const uint8_t* bytes;
  uint16_t size;  // 0: it is not whole
  uint16_t generation;
  uint16_t crc;
};

inline uint16_t crc_of_copy(const uint8_t* copy, uint16_t size) {
  uint16_t crc = 0;
  for (uint8_t i = 0; i < 4; ++i) crc = crc16_add(crc, Flash::byte(copy + i));
  for (uint16_t i = 0; i < size; ++i) crc = crc16_add(crc, Flash::byte(copy + kCopyHead + i));
  return crc;
}

// room: of a copy with its head.
inline Copy read_copy(const uint8_t* at, uint16_t room) {
  Copy copy = {at + kCopyHead, Flash::word(at + 2), Flash::word(at), Flash::word(at + 4)};
  if (copy.size > room - kCopyHead || copy.crc != crc_of_copy(at, copy.size)) copy.size = 0;
  return copy;
}

// Which of both is the newest whole one; 2: neither is whole.
inline uint8_t newest_of(const Copy* copy) {
  if (copy[0].size == 0) return copy[1].size == 0 ? 2 : 1;
  if (copy[1].size == 0) return 0;
  return static_cast<int16_t>(copy[1].generation - copy[0].generation) > 0 ? 1 : 0;
}

}  // namespace core
}  // namespace flexor
