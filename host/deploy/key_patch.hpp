// The key's record (runtime/link/key_record.hpp) in flash content, at its place in each board.
#pragma once

#include <string>

#include "host/deploy/config.hpp"
#include "host/deploy/intel_hex.hpp"
#include "runtime/link/key_record.hpp"

namespace flexor::deploy {

// Of a key, or of none: plain frames.
link::KeyRecord key_record(const Key& key);

// The key that a board's flash holds, `name` for errors. Throws io::InputError, one line: no record, or a damaged one.
Key key_in(const FlashContent& content, const std::string& name);

// The page of flash that holds the record.
FlashContent page_with_key(const Key& key);

}  // namespace flexor::deploy
