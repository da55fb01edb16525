#include "host/deploy/images.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "host/deploy/model_block.hpp"
#include "host/io/io.hpp"
#include "runtime/core/flash_map.hpp"

namespace flexor::deploy {
namespace {

constexpr std::string_view kKeyMagic = "FLXKEY01";

void put(FlashContent& flash, std::size_t at, const Bytes& bytes) {
  flash.bytes.resize(std::max(flash.bytes.size(), at + bytes.size()), 0xff);
  std::ranges::copy(bytes, flash.bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

template <class Struct>
Bytes bytes_of(const Struct& one) {
  Bytes out(sizeof(one));
  std::memcpy(out.data(), &one, sizeof(one));
  return out;
}

FlashContent with_settings(const Image& image, const Key& key, const Bytes& settings) {
  FlashContent out = image.content;
  put(out, core::kKeyBegin, bytes_of(key_record(key)));
  put(out, core::kSettingsBegin, copy_of(settings, 0));
  return out;
}

}  // namespace

FlashContent glove_flash(const Glove& glove) {
  FlashContent out = with_settings(glove_image(), glove.key, bytes_of(glove_settings(glove)));
  const Bytes copy = copy_of(flash_block(glove), 0);
  for (std::size_t i = 0; i < 2; ++i) put(out, core::kModelBegin + i * core::kModelCopy, copy);
  return out;
}

FlashContent hand_flash(const Hand& hand) {
  return with_settings(hand_image(), hand.key, bytes_of(hand_settings(hand)));
}

FlashContent with_generation(FlashContent flash, std::uint16_t generation) {
  if (!glove_settings_in(flash)) return flash;
  flash = whole(std::move(flash));
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t at = core::kModelBegin + i * core::kModelCopy;
    const core::Copy copy = core::read_copy(flash.bytes.data() + at, core::kModelCopy);
    if (copy.size > 0) put(flash, at, copy_of({copy.bytes, copy.bytes + copy.size}, generation));
  }
  return flash;
}

Bytes copy_of(const Bytes& block, std::uint16_t generation) {
  const std::size_t size = block.size();
  Bytes out(core::kCopyHead, 0);
  const auto word = [&](std::size_t at, std::size_t value) {
    out[at] = static_cast<std::uint8_t>(value & 0xff);
    out[at + 1] = static_cast<std::uint8_t>(value >> 8);
  };
  word(0, generation);
  word(2, size);
  out.insert(out.end(), block.begin(), block.end());
  word(4, core::crc_of_copy(out.data(), static_cast<std::uint16_t>(size)));
  return out;
}

FlashContent whole(FlashContent content) {
  content.bytes.resize(std::max<std::size_t>(content.bytes.size(), core::kDataEnd), 0xff);
  return content;
}

std::optional<glove::Settings> glove_settings_in(const FlashContent& content) {
  const FlashContent all = whole(content);
  const glove::Settings* found = core::find_settings<glove::Settings>(all.bytes.data());
  return found == nullptr ? std::nullopt : std::optional(*found);
}

link::KeyRecord key_record(const Key& key) {
  link::KeyRecord record{};
  std::ranges::copy(kKeyMagic, record.magic);
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
                     std::equal(kKeyMagic.begin(), kKeyMagic.end(), content.bytes.begin() + core::kKeyBegin);
  if (!there) {
    throw io::InputError(
        "{}: holds no key record: it is no image of this Flexor: deploy it and flash it again", name);
  }
  link::KeyRecord record;
  std::memcpy(&record, content.bytes.data() + core::kKeyBegin, sizeof(record));
  link::Key key{};
  if (!link::load(&record, key)) throw io::InputError("{}: its key record is damaged: flash it again", name);
  if (link::is_plain(key)) return {};
  return key;
}

FlashContent page_with_key(const Key& key) {
  FlashContent page{Bytes(core::kKeyBegin + core::kFlashPage, 0xff), core::kKeyBegin};
  put(page, core::kKeyBegin, bytes_of(key_record(key)));
  return page;
}

}  // namespace flexor::deploy
