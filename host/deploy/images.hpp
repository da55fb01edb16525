// The firmware of both boards, built with this program and carried in it; settings, key and model are put behind it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "host/deploy/config.hpp"
#include "host/deploy/intel_hex.hpp"
#include "runtime/link/key_record.hpp"

namespace flexor::deploy {

struct Image {
  FlashContent content;
  std::map<std::string, std::uint16_t> symbols;  // addresses in RAM, for a simulator

  int flash_bytes() const { return static_cast<int>(content.bytes.size()); }  // code and initialised data
  int ram_bytes() const { return symbols.at("__bss_end") - 0x100; }           // static
};

const Image& glove_image();
const Image& hand_image();

// A board's flash: image, key, settings and, of a glove, the model, both copies the same. Throws
// io::InputError where something does not fit, with the mend.
FlashContent glove_flash(const Glove& glove);
FlashContent hand_flash(const Hand& hand);

// The same with the model in another generation, so that a model that was sent into the board's EEPROM counts no more. What is
// no glove's flash stays.
FlashContent with_generation(FlashContent flash, std::uint16_t generation);

// A block as a copy of it lies in flash (runtime/core/copies.hpp).
Bytes copy_of(const Bytes& block, std::uint16_t generation);

// With all that is written below the bootloader, as it is erased.
FlashContent whole(FlashContent content);

// What a board's flash holds of this version.
std::optional<glove::Settings> glove_settings_in(const FlashContent& content);

// The record of a key, or of none: plain frames.
link::KeyRecord key_record(const Key& key);
// The key that a board's flash holds, `name` for errors. Throws io::InputError, one line: no record, or a damaged one.
Key key_in(const FlashContent& content, const std::string& name);
// The page of flash that holds the record.
FlashContent page_with_key(const Key& key);

}  // namespace flexor::deploy
