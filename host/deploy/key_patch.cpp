#include "host/deploy/key_patch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "host/io/io.hpp"

namespace flexor::deploy {
namespace {

using io::InputError;

constexpr std::string_view kMagic = "FLXKEY01";
constexpr std::size_t kPageBytes = 128;  // of an ATmega328P's flash

link::KeyRecord record_at(const FlashContent& content, std::size_t address) {
  link::KeyRecord record;
  std::memcpy(&record, content.bytes.data() + address, sizeof(record));
  return record;
}

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

std::size_t find_key_record(const FlashContent& content, const std::string& name) {
  const auto find = [&](std::size_t from) {
    const auto at = std::search(content.bytes.begin() + static_cast<std::ptrdiff_t>(from),
                                content.bytes.end(), kMagic.begin(), kMagic.end());
    return static_cast<std::size_t>(at - content.bytes.begin());
  };
  const std::size_t at = find(0);
  const std::size_t none = content.bytes.size();
  if (at == none) {
    throw InputError(fmt::format(
        "{}: holds no key record: a glove for VR drivers has no radio and needs none; else it is no image of "
        "this Flexor: deploy it and flash it anew",
        name));
  }
  if (find(at + 1) != none) throw InputError(fmt::format("{}: holds two key records: flash it anew", name));
  link::Key ignored{};
  if (at + sizeof(link::KeyRecord) > none || at % sizeof(link::KeyRecord) != 0)
    throw InputError(fmt::format("{}: its key record is not where one may lie: flash it anew", name));
  const link::KeyRecord record = record_at(content, at);
  if (!link::load(&record, ignored))
    throw InputError(fmt::format("{}: its key record is damaged: flash it anew", name));
  return at;
}

Key key_in(const FlashContent& content, std::size_t address) {
  const link::KeyRecord record = record_at(content, address);
  link::Key key{};
  if (!link::load(&record, key) || link::is_plain(key)) return {};
  return key;
}

FlashContent page_with_key(const FlashContent& content, std::size_t address, const Key& key) {
  FlashContent page{content.bytes, address / kPageBytes * kPageBytes};
  page.bytes.resize(page.begin + kPageBytes, 0xff);
  const link::KeyRecord record = key_record(key);
  std::memcpy(page.bytes.data() + address, &record, sizeof(record));
  return page;
}

}  // namespace flexor::deploy
