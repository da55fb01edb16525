// A counter that only grows, kept in EEPROM: survives resets at any instant and spreads the wear.
//
// A record is four bytes of value, least significant first, and two of CRC over them and a salt, so that
// erased and half-written records are none. Records are written round and round; the greatest valid one
// counts. kSlots records of 100 000 writes each: 12.8 million in all.
#pragma once

#include "runtime/core/crc16.hpp"

namespace flexor {
namespace link {

constexpr uint8_t kSlots = 128;
constexpr uint8_t kRecordBytes = 6;  // 768 of the ATmega328P's 1024 bytes

// Eeprom: uint8_t read(uint16_t address); bool ready(); void write(uint16_t address, uint8_t byte), called
// when ready only.
template <class Eeprom>
class CounterStore {
 public:
  // Looks for the greatest value; 0 if there is none.
  uint32_t load(Eeprom& eeprom) {
    uint32_t greatest = 0;
    uint16_t address = 0;
    for (uint8_t slot = 0; slot < kSlots; ++slot) {
      Record found;
      uint8_t* byte = reinterpret_cast<uint8_t*>(&found);
      for (uint8_t i = 0; i < kRecordBytes; ++i) byte[i] = eeprom.read(address++);
      if (found.crc != crc_of(found) || found.value < greatest) continue;
      greatest = found.value;
      next_ = slot + 1 < kSlots ? address : 0;
    }
    return greatest;
  }

  // Starts to write `value`; false while the record before is still being written.
  bool save(uint32_t value) {
    if (at_ < kRecordBytes) return false;
    record_.value = value;
    record_.crc = crc_of(record_);
    at_ = 0;
    return true;
  }

  // Writes at most one byte (3.4 ms on the ATmega328P, in the background); true once nothing is left to
  // write.
  bool work(Eeprom& eeprom) {
    if (!eeprom.ready()) return false;
    if (at_ == kRecordBytes) return true;
    eeprom.write(next_++, reinterpret_cast<const uint8_t*>(&record_)[at_++]);
    if (next_ == kSlots * kRecordBytes) next_ = 0;
    return false;
  }

 private:
  struct __attribute__((packed)) Record {
    uint32_t value;
    uint16_t crc;
  };
  static_assert(sizeof(Record) == kRecordBytes && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
                "bytes lie as they are written");

  static uint16_t crc_of(const Record& record) {
    constexpr uint16_t kSalt = 0x464c;  // a record of zeros is none
    return core::crc16(reinterpret_cast<const uint8_t*>(&record), sizeof(record.value), kSalt);
  }

  Record record_ = {};
  uint16_t next_ = 0;  // address
  uint8_t at_ = kRecordBytes;
};

}  // namespace link
}  // namespace flexor
