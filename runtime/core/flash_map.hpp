// Where an ATmega328P keeps what: the same in every board, so that an image is built once and told the rest as data.
//
//   0x0000   image
//   0x6380   record of the pair's key (link/key_record.hpp), a page
//   0x6400   settings (one of core/copies.hpp); they change with the image only
//   0x6700   model, two copies; a glove's
//   0x7800   bootloader
#pragma once

#include "runtime/core/copies.hpp"

namespace flexor {
namespace core {

constexpr uint16_t kKeyBegin = 0x6380;  // an image ends before it
constexpr uint16_t kSettingsBegin = kKeyBegin + kFlashPage;
constexpr uint16_t kSettingsCopy = 6 * kFlashPage;
constexpr uint16_t kModelBegin = kSettingsBegin + kSettingsCopy;
constexpr uint16_t kModelCopy = 17 * kFlashPage;
constexpr uint16_t kDataEnd = kModelBegin + 2 * kModelCopy;
static_assert(kDataEnd <= 0x7800, "before the old bootloader");

}  // namespace core
}  // namespace flexor
