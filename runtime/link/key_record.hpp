// The pair's key where it outlives an erased EEPROM and can be replaced without a compiler: a marked record in flash,
// which `flexor pair` finds in an image, or in a board through its bootloader. 32 bytes at a multiple of 32: within one
// page of flash, so that it is written as a whole or not at all.
//
//   magic "FLXKEY01" | key, 16 bytes | CRC-16 of both, low byte first | 6 bytes of 0
//
// A key of zeros: plain frames, no guard.
#pragma once

#include <stdint.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#endif

#include "runtime/core/crc16.hpp"
#include "runtime/link/siphash.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kKeyMagicBytes = 8;
constexpr uint8_t kKeyRecordBytes = 32;
constexpr uint8_t kKeyCrcAt = kKeyMagicBytes + sizeof(Key::bytes);

struct __attribute__((aligned(kKeyRecordBytes))) KeyRecord {
  uint8_t magic[kKeyMagicBytes];
  uint8_t key[sizeof(Key::bytes)];
  uint8_t crc[2];
  uint8_t spare[6];
};
static_assert(sizeof(KeyRecord) == kKeyRecordBytes, "as it lies in flash");

// The record's bytes are read one by one from where they lie, in flash on an AVR: what the compiler knew of them when it
// built the image does not count. False: it is damaged, and `key` is not to be used; the board had better be silent than
// plain. The magic itself is not written here: an image holds it once.
inline bool load(const KeyRecord* record, Key& key) {
  const uint8_t* at = reinterpret_cast<const uint8_t*>(record);
  uint16_t crc = 0;
  uint16_t stored = 0;
  for (uint8_t i = 0; i < kKeyCrcAt + 2; ++i) {
#ifdef __AVR__
    const uint8_t byte = pgm_read_byte(at + i);
#else
    const uint8_t byte = *reinterpret_cast<const volatile uint8_t*>(at + i);
#endif
    const uint8_t in_key = static_cast<uint8_t>(i - kKeyMagicBytes);
    if (i >= kKeyCrcAt) {
      stored = static_cast<uint16_t>((stored >> 8) | (static_cast<uint16_t>(byte) << 8));
      continue;
    }
    if (i >= kKeyMagicBytes) key.bytes[in_key] = byte;
    crc = core::crc16_add(crc, byte);
  }
  return crc == stored;
}

// Of a key that load() gave.
inline bool is_plain(const Key& key) {
  uint8_t any = 0;
  for (const uint8_t byte : key.bytes) any = static_cast<uint8_t>(any | byte);
  return any == 0;
}

}  // namespace link
}  // namespace flexor
