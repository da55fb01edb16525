// The corrections of sensor/zero.hpp in EEPROM: two records by turns, so that power that is lost at any instant
// leaves the old ones or the new.
//
//   record   generation u8, gain and offset i16 of each sensor, CRC-16 of these
// The CRC starts with `made_for`, the poses that the corrections refer to: with another model's they count no more.
#pragma once

#include "runtime/core/crc16.hpp"
#include "runtime/sensor/zero.hpp"

namespace flexor {
namespace glove {

// Eeprom: as in link/counter_store.hpp.
template <class Eeprom, uint8_t kSensors>
class ZeroStore {
 public:
  static constexpr uint8_t kRecordBytes = 1 + 4 * kSensors + 2;
  static_assert(2 * kRecordBytes <= 64, "before the model's store");

  // Those that are being written, else the newest record's, if made for this; false, and none at all, where there are none.
  bool load(Eeprom& eeprom, uint16_t made_for, sensor::Correction* correction) {
    if (at_ < kRecordBytes && made_for == made_for_) {
      __builtin_memcpy(correction, record_.bytes + 1, 4 * kSensors);
      return true;
    }
    at_ = kRecordBytes;
    made_for_ = made_for;
    for (uint8_t i = 0; i < kSensors; ++i) correction[i] = sensor::kUncorrected;
    bool found = false;
    for (uint8_t place = 0; place < 2; ++place) {
      Record record;
      for (uint8_t i = 0; i < kRecordBytes; ++i)
        record.bytes[i] = eeprom.read(static_cast<uint16_t>(place * kRecordBytes + i));
      if (crc_of(record) != crc_in(record)) continue;
      if (found && static_cast<int8_t>(record.bytes[0] - generation_) < 0) continue;
      found = true;
      generation_ = record.bytes[0];
      place_ = static_cast<uint8_t>(1 - place);
      __builtin_memcpy(correction, record.bytes + 1, 4 * kSensors);
    }
    return found;
  }

  // Starts to write them; whatever was being written before is given up.
  void save(const sensor::Correction* correction) {
    record_.bytes[0] = ++generation_;
    __builtin_memcpy(record_.bytes + 1, correction, 4 * kSensors);
    const uint16_t crc = crc_of(record_);
    record_.bytes[kRecordBytes - 2] = static_cast<uint8_t>(crc);
    record_.bytes[kRecordBytes - 1] = static_cast<uint8_t>(crc >> 8);
    at_ = 0;
  }

  // Writes at most one byte; true once nothing is left to write.
  bool work(Eeprom& eeprom) {
    if (at_ == kRecordBytes) return true;
    if (!eeprom.ready()) return false;
    eeprom.write(static_cast<uint16_t>(place_ * kRecordBytes + at_), record_.bytes[at_]);
    if (++at_ < kRecordBytes) return false;
    place_ = static_cast<uint8_t>(1 - place_);
    return true;
  }

 private:
  struct Record {
    uint8_t bytes[kRecordBytes];
  };
  static_assert(sizeof(sensor::Correction) == 4, "as it lies in a record");

  uint16_t crc_of(const Record& record) const {
    uint16_t crc = made_for_;
    for (uint8_t i = 0; i < kRecordBytes - 2; ++i) crc = core::crc16_add(crc, record.bytes[i]);
    return crc;
  }
  static uint16_t crc_in(const Record& record) {
    return static_cast<uint16_t>(record.bytes[kRecordBytes - 2] | record.bytes[kRecordBytes - 1] << 8);
  }

  uint16_t made_for_ = 0;
  uint8_t generation_ = 0;
  uint8_t place_ = 0;
  uint8_t at_ = kRecordBytes;
  Record record_ = {};
};

}  // namespace glove
}  // namespace flexor
