// The key that a glove and a hand share: made, read, and written where only its owner can read it.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/link/siphash.hpp"

namespace flexor::deploy {

// A random key from the system. Throws io::JobError.
link::Key new_key();

// 32 hexadecimal digits.
std::string to_hex(const link::Key& key);

// True for 32 hexadecimal digits.
bool is_key(const std::string& text);

// Throws io::InputError unless is_key(hex) and one digit is not 0, without repeating what might be most of a secret.
link::Key key_from_hex(const std::string& hex);

// A file of 32 hexadecimal digits, as deploy writes it; "-" is standard input. Throws io::InputError when it
// is missing, unreadable, or anything else.
link::Key load_key(const std::filesystem::path& path);

// A file that is readable and writable by its owner alone, by the rules and with the errors of
// host/io/output.hpp.
void write_key(const std::filesystem::path& path, const link::Key& key);

// Before `next` takes the place of the key in the file `path`: one that was another is copied beside it, to PATH.old, or
// PATH.old-2 and so on where older ones are; boards may still have it. A line that reports it, empty where there was none to keep.
// Throws io::InputError where the file holds no key: it might have been one.
std::string keep_old_key(const std::filesystem::path& path, const link::Key& next);

}  // namespace flexor::deploy
