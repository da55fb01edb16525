// Where an ATmega328P keeps what: the same in every board, so that an image is built once and given the rest as data.
//
//   0x0000   image; behind its 26 vectors an ImageId
//   0x6380   record of the pair's key (link/key_record.hpp), a page
//   0x6400   settings (one of core/copies.hpp)
//   0x6700   model, two copies; a glove's. Settings that replace others are written over the copy that does not run
//            first, then at their place: power that is lost at any instant leaves the old ones or the new
//   0x7800   bootloader
#pragma once

#include "runtime/core/copies.hpp"

namespace flexor {
namespace core {

constexpr uint16_t kImageIdBegin = 26 * 4;
constexpr uint16_t kKeyBegin = 0x6380;  // an image ends before it
constexpr uint16_t kSettingsBegin = kKeyBegin + kFlashPage;
constexpr uint16_t kSettingsCopy = 6 * kFlashPage;
constexpr uint16_t kModelBegin = kSettingsBegin + kSettingsCopy;
constexpr uint16_t kModelCopy = 17 * kFlashPage;
constexpr uint16_t kDataEnd = kModelBegin + 2 * kModelCopy;
static_assert(kDataEnd <= 0x7800, "before the old bootloader");

// How an image identifies itself.
struct ImageId {
  char mark[2];   // FX
  uint8_t board;  // link::BoardKind
  uint8_t version[3];
};

// A board's settings, a struct that begins with its kKind; null: there are none. `flash`: address 0.
template <class Settings>
FLEXOR_SHARED const Settings* find_settings(const uint8_t* flash) {
  for (uint16_t at = kSettingsBegin; at < kDataEnd;
       at = static_cast<uint16_t>(at + (at == kSettingsBegin ? kSettingsCopy : kModelCopy))) {
    const Copy copy = read_copy(flash + at, kSettingsCopy);
    if (copy.size == sizeof(Settings) && Flash::word(copy.bytes) == Settings::kKind)
      return reinterpret_cast<const Settings*>(copy.bytes);
  }
  return nullptr;
}

}  // namespace core
}  // namespace flexor
