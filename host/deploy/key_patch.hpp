// The key's record (runtime/link/key_record.hpp) in flash content: made, found, replaced.
#pragma once

#include <string>

#include "host/deploy/config.hpp"
#include "host/deploy/intel_hex.hpp"
#include "runtime/link/key_record.hpp"

namespace flexor::deploy {

// Of a key, or of none: plain frames.
link::KeyRecord key_record(const Key& key);

// Where the record lies in `content`, which `name` names. Throws io::InputError, one line: no record (an image of before
// there were records, or no image), two, or one that is damaged.
std::size_t find_key_record(const FlashContent& content, const std::string& name);

// The key that the record at `address` holds.
Key key_in(const FlashContent& content, std::size_t address);

// The page of flash that holds the record at `address`, with `key` in it and all else as it is in `content`.
FlashContent page_with_key(const FlashContent& content, std::size_t address, const Key& key);

}  // namespace flexor::deploy
