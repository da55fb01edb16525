// A sent model in EEPROM: of two slots it is written to the one that does not hold the newest, and counts from its last
// byte on. Power that is lost at any instant leaves the old model or the new one.
//
//   slot   mark u8, generation u8, size u16, CRC-16 of `base`, these and the bytes, bytes
//
// `mark` is 0 in a slot that counts: it is made invalid before anything else of a slot changes, and written last, once the
// rest has been read back and has been tried. find() gives what is whole from then on, and the next start only once it counts.
// base: CRC-16 of the model in flash. What was sent to a glove counts no more once another model has been flashed.
#pragma once

#include "runtime/core/crc16.hpp"

namespace flexor {
namespace glove {

constexpr uint16_t kStoreBegin = 64;  // before it lies the zero
constexpr uint16_t kStoreEnd = 1024;  // of the ATmega328P's EEPROM
constexpr uint8_t kSlotHead = 6;
constexpr uint8_t kChunk = 24;  // bytes of a write at most

// Bytes of a model that a slot holds.
constexpr uint16_t kSlotRoom = (kStoreEnd - kStoreBegin) / 2 - kSlotHead;

// What became of the last order.
enum class Stored : uint8_t {
  idle,
  writing,
  ready,      // for the next write, or commit
  whole,      // read back, but for the byte that makes it count: keep(), or drop()
  committed,  // in EEPROM, and read back
  failed,     // what was read back is not what was sent
};

// Of a model's bytes in EEPROM.
struct Place {
  uint16_t address = 0;
  uint16_t size = 0;
};

// Eeprom: as in link/counter_store.hpp.
template <class Eeprom>
class ModelStore {
 public:
  explicit ModelStore(uint16_t base) : base_(base) {}

  uint16_t base() const { return base_; }

  // The one that is whole, else the newest that counts; size 0: there is none.
  Place find(Eeprom& eeprom) const {
    const uint8_t slot = state_ == Stored::whole ? slot_ : newest(eeprom);
    Place place;
    if (slot == kNone) return place;
    place.address = static_cast<uint16_t>(begin_of(slot) + kSlotHead);
    place.size = word(eeprom, static_cast<uint16_t>(begin_of(slot) + kSize));
    return place;
  }

  // A checksum of both slots' heads: another one after each model that was written.
  uint16_t digest(Eeprom& eeprom) const {
    uint16_t crc = base_;
    for (uint8_t slot = 0; slot < kSlots; ++slot) {
      for (uint8_t i = 0; i < kSlotHead; ++i)
        crc = core::crc16_add(crc, eeprom.read(static_cast<uint16_t>(begin_of(slot) + i)));
    }
    return crc;
  }

  // Of what is whole: it counts, as soon as it is committed; or never.
  void keep() {
    chunk_[0] = kCounts;
    order(kMark, 1);
    committing_ = true;
  }
  void drop() { state_ = Stored::idle; }

  // Begins with a model again, whatever was being written before; false: it is too large.
  bool begin(Eeprom& eeprom, uint16_t size) {
    if (size == 0 || size > kSlotRoom) return false;
    const uint8_t old = newest(eeprom);
    const uint8_t generation =
        old == kNone ? 0 : eeprom.read(static_cast<uint16_t>(begin_of(old) + kGeneration));
    slot_ = old == 0 ? 1 : 0;
    generation_ = static_cast<uint8_t>(generation + 1);
    size_ = size;
    received_ = 0;
    crc_ = start(generation_, size_);
    order(kMark, 1);
    chunk_[0] = kNothing;
    return true;
  }

  // Bytes that have come: the offset of the next write.
  uint16_t received() const { return received_; }

  // Up to kChunk bytes more; false while busy, or where they do not belong.
  bool write(uint16_t offset, const uint8_t* bytes, uint8_t count) {
    if (state_ != Stored::ready || offset != received_ || count == 0 || count > kChunk) return false;
    if (count > size_ - received_) return false;
    order(static_cast<uint16_t>(kSlotHead + offset), count);
    for (uint8_t i = 0; i < count; ++i) {
      chunk_[i] = bytes[i];
      crc_ = core::crc16_add(crc_, bytes[i]);
    }
    received_ = static_cast<uint16_t>(received_ + count);
    return true;
  }

  // After the last byte; false while busy, or where bytes are missing.
  bool commit() {
    if (state_ != Stored::ready || received_ != size_) return false;
    const uint8_t head[] = {generation_, static_cast<uint8_t>(size_), static_cast<uint8_t>(size_ >> 8),
                            static_cast<uint8_t>(crc_), static_cast<uint8_t>(crc_ >> 8)};
    order(kGeneration, sizeof(head));
    for (uint8_t i = 0; i < count_; ++i) chunk_[i] = head[i];
    committing_ = true;
    return true;
  }

  // Writes at most one byte (3.4 ms on the ATmega328P, in the background).
  Stored work(Eeprom& eeprom) {
    if (state_ != Stored::writing || !eeprom.ready()) return state_;
    if (at_ < count_) {
      eeprom.write(static_cast<uint16_t>(begin_of(slot_) + offset_ + at_), chunk_[at_]);
      ++at_;
      return state_;
    }
    for (uint8_t i = 0; i < count_; ++i) {
      if (eeprom.read(static_cast<uint16_t>(begin_of(slot_) + offset_ + i)) != chunk_[i])
        return state_ = Stored::failed;
    }
    if (!committing_) return state_ = Stored::ready;
    if (offset_ == kMark) return state_ = Stored::committed;
    return state_ = is_sound(eeprom, slot_) ? Stored::whole : Stored::failed;
  }

 private:
  static constexpr uint8_t kSlots = 2;
  static constexpr uint8_t kNone = 0xff;
  static constexpr uint8_t kCounts = 0;
  static constexpr uint8_t kNothing = 0xff;  // as erased EEPROM
  enum Offset : uint8_t { kMark, kGeneration, kSize, kSizeHigh, kCrc };

  static uint16_t begin_of(uint8_t slot) {
    return static_cast<uint16_t>(kStoreBegin + slot * (kSlotRoom + kSlotHead));
  }
  static uint16_t word(Eeprom& eeprom, uint16_t address) {
    return static_cast<uint16_t>(eeprom.read(address) | eeprom.read(static_cast<uint16_t>(address + 1)) << 8);
  }

  void order(uint16_t offset, uint8_t count) {
    offset_ = offset;
    count_ = count;
    at_ = 0;
    committing_ = false;
    state_ = Stored::writing;
  }

  uint16_t start(uint8_t generation, uint16_t size) const {
    uint16_t crc = base_;
    crc = core::crc16_add(crc, kNothing);  // a slot of zeros is none
    crc = core::crc16_add(crc, generation);
    crc = core::crc16_add(crc, static_cast<uint8_t>(size));
    return core::crc16_add(crc, static_cast<uint8_t>(size >> 8));
  }

  // Whether the slot holds a model, but for the byte that marks it.
  bool is_sound(Eeprom& eeprom, uint8_t slot) const {
    const uint16_t from = begin_of(slot);
    const uint16_t size = word(eeprom, static_cast<uint16_t>(from + kSize));
    if (size == 0 || size > kSlotRoom) return false;
    uint16_t crc = start(eeprom.read(static_cast<uint16_t>(from + kGeneration)), size);
    for (uint16_t i = 0; i < size; ++i) {
      crc = core::crc16_add(crc, eeprom.read(static_cast<uint16_t>(from + kSlotHead + i)));
    }
    return crc == word(eeprom, static_cast<uint16_t>(from + kCrc));
  }

  uint8_t newest(Eeprom& eeprom) const {
    uint8_t found = kNone;
    uint8_t generation = 0;
    for (uint8_t slot = 0; slot < kSlots; ++slot) {
      const uint16_t from = begin_of(slot);
      if (eeprom.read(from) != kCounts || !is_sound(eeprom, slot)) continue;
      const uint8_t its = eeprom.read(static_cast<uint16_t>(from + kGeneration));
      if (found != kNone && static_cast<int8_t>(its - generation) < 0) continue;
      found = slot;
      generation = its;
    }
    return found;
  }

  uint16_t base_;
  uint16_t size_ = 0;
  uint16_t received_ = 0;
  uint16_t crc_ = 0;
  uint16_t offset_ = 0;  // in the slot, of the chunk
  uint8_t chunk_[kChunk] = {};
  uint8_t count_ = 0;  // of the chunk
  uint8_t at_ = 0;     // written of it
  uint8_t slot_ = 0;
  uint8_t generation_ = 0;
  bool committing_ = false;
  Stored state_ = Stored::idle;
};

}  // namespace glove
}  // namespace flexor
