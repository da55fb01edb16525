// The compensator of an image whose model lies in pages of flash: two copies, of which the newest whole one runs. Only a
// bootloader writes them, over USB, one while the other stays: power that is lost at any instant leaves the old model or
// the new one, and RAM holds no more of it than its states.
//
//   magic "FLXMDL01", image u16, rate_hz u8, version of parts u8, calibration u16 of each strip, bytes of a copy u16, CRC-16; to a page's end
//   copy     generation u16, size u16, CRC-16 of image, these and the part, 0 u16; the part; twice
//
// image: CRC-16 of the model that was built in: copies that were sent to another image count no more.
#pragma once

#include "runtime/glove/model_settings.hpp"

namespace flexor {
namespace glove {

constexpr uint8_t kFlashPage = 128;  // bytes, of an ATmega328P
constexpr uint8_t kModelMagicBytes = 8;
constexpr uint8_t kCopyHead = 8;

struct ModelRecord {
  uint8_t magic[kModelMagicBytes];
  uint16_t image;
  uint8_t rate_hz;
  uint8_t version;  // compensator::kGraphVersion
  uint16_t calibration[compensator::kStrips];
  uint16_t copy_bytes;
  uint16_t crc;
  uint8_t fill[kFlashPage - kModelMagicBytes - 18];
};
static_assert(sizeof(ModelRecord) == kFlashPage, "as it lies in flash");

// kBytes: whole pages.
template <uint16_t kBytes>
struct __attribute__((aligned(kFlashPage))) ModelPages {
  static_assert(kBytes % kFlashPage == 0, "a page belongs to one copy");
  ModelRecord record;
  uint8_t copy[2][kBytes];
};

// Of a copy that is there.
struct Copy {
  const uint8_t* part;
  uint16_t size;
  uint16_t generation;
};

inline uint16_t crc_of_copy(uint16_t image, const uint8_t* copy, uint16_t size) {
  using Place = core::Flash;
  uint16_t crc = image;
  for (uint8_t i = 0; i < 4; ++i) crc = core::crc16_add(crc, Place::byte(copy + i));
  for (uint16_t i = 0; i < size; ++i) crc = core::crc16_add(crc, Place::byte(copy + kCopyHead + i));
  return crc;
}

// False: it is not whole, or another image's.
inline bool read_copy(const uint8_t* at, uint16_t bytes, uint16_t image, Copy& copy) {
  using Place = core::Flash;
  copy = {at + kCopyHead, Place::word(at + 2), Place::word(at)};
  if (copy.size == 0 || copy.size > bytes - kCopyHead) return false;
  return Place::word(at + 4) == crc_of_copy(image, at, copy.size);
}

// Which of both copies is to run; 2: none.
inline uint8_t newest_copy(const bool* whole, const Copy* copy) {
  if (!whole[0]) return whole[1] ? 1 : 2;
  if (!whole[1]) return 0;
  return static_cast<int16_t>(copy[1].generation - copy[0].generation) > 0 ? 1 : 0;
}

// kArena: for states.
template <uint16_t kArena>
class FlashModel : public compensator::Graph<core::Flash, kArena> {
 public:
  // The newest copy that can run; without one every finger stays at rest and says that it is not sensed. Takes some
  // milliseconds.
  template <uint16_t kBytes, class Settings>
  compensator::Loaded load(const ModelPages<kBytes>& pages, uint16_t image,
                           const compensator::MadeFor& made_for, Settings* settings) {
    bool whole[2];
    Copy copy[2];
    for (uint8_t i = 0; i < 2; ++i) whole[i] = read_copy(pages.copy[i], kBytes, image, copy[i]);
    compensator::Loaded loaded = compensator::Loaded::corrupt;
    for (uint8_t tries = 0; tries < 2; ++tries) {
      const uint8_t i = newest_copy(whole, copy);
      this->clear();
      clear_settings(settings);
      if (i == 2) return loaded;
      loaded = this->add(copy[i].part, copy[i].size, made_for);
      if (loaded == compensator::Loaded::ok) {
        describe<core::Flash>(copy[i].part, settings);
        return loaded;
      }
      whole[i] = false;
    }
    this->clear();
    return loaded;
  }
};

}  // namespace glove
}  // namespace flexor
