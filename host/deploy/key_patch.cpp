#include "host/deploy/key_patch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "host/io/io.hpp"
#include "runtime/core/flash_map.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

constexpr std::string_view kMagic = "FLXKEY01";

}  // namespace

link::KeyRecord key_record(const Key& key) {
  link::KeyRecord record{};
  std::ranges::copy(kMagic, record.magic);
  if (key) std::ranges::copy(key->bytes, record.key);
  const std::uint16_t crc =
      core::crc16(record.magic, static_cast<std::uint8_t>(sizeof(record.magic) + sizeof(record.key)));
  record.crc[0] = static_cast<std::uint8_t>(crc);
  record.crc[1] = static_cast<std::uint8_t>(crc >> 8);
  return record;
}

Key key_in(const FlashContent& content, const std::string& name) {
  constexpr std::size_t kEnd = core::kKeyBegin + sizeof(link::KeyRecord);
  const bool there = content.bytes.size() >= kEnd &&
                     std::equal(kMagic.begin(), kMagic.end(), content.bytes.begin() + core::kKeyBegin);
  if (!there) {
    throw InputError(fmt::format(
        "{}: holds no key record: it is no image of this Flexor: deploy it and flash it anew", name));
  }
  link::KeyRecord record;
  std::memcpy(&record, content.bytes.data() + core::kKeyBegin, sizeof(record));
  link::Key key{};
  if (!link::load(&record, key))
    throw InputError(fmt::format("{}: its key record is damaged: flash it anew", name));
  if (link::is_plain(key)) return {};
  return key;
}

FlashContent page_with_key(const Key& key) {
  FlashContent page{std::vector<std::uint8_t>(core::kKeyBegin + core::kFlashPage, 0xff), core::kKeyBegin};
  const link::KeyRecord record = key_record(key);
  std::memcpy(page.bytes.data() + core::kKeyBegin, &record, sizeof(record));
  return page;
}

}  // namespace flexor::deploy
